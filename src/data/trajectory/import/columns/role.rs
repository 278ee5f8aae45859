//! Meaning of a column of a mapped table.

use super::map::Rows;
use super::unit::Quantity;

/// The role of a column, by its key in a map.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub(super) enum Role {
    Time,
    Id,
    Ahead,
    Group,
    Lane,
    /// Who drives the vehicle of the row, or the follower.
    Driver,
    Position,
    Speed,
    Acceleration,
    Length,
    Gap,
    Headway,
    SinGrade,
    LeadSpeed,
    /// Speed of the vehicle ahead minus that of the follower, as a radar measures it.
    #[strum(to_string = "relative_speed", serialize = "range_rate")]
    RelativeSpeed,
    LeadPosition,
    LeadLength,
    Lead2Speed,
    Lead2Gap,
}

impl Role {
    /// The measured quantity; `None`: a name.
    pub fn quantity(self) -> Option<Quantity> {
        match self {
            Role::Id | Role::Ahead | Role::Group | Role::Lane | Role::Driver => None,
            Role::Time => Some(Quantity::Time),
            Role::Speed | Role::LeadSpeed | Role::RelativeSpeed | Role::Lead2Speed => Some(Quantity::Speed),
            Role::Acceleration => Some(Quantity::Acceleration),
            Role::SinGrade => Some(Quantity::Ratio),
            Role::Position
            | Role::Length
            | Role::Gap
            | Role::Headway
            | Role::LeadPosition
            | Role::LeadLength
            | Role::Lead2Gap => Some(Quantity::Length),
        }
    }

    /// True if it is valid in a table with such rows.
    pub fn is_in(self, rows: Rows) -> bool {
        match rows {
            Rows::Vehicles => self.in_vehicles(),
            Rows::Pairs => self.in_pairs(),
            Rows::Platoon => self.in_platoon(),
        }
    }

    /// With one row per vehicle and time.
    fn in_vehicles(self) -> bool {
        !matches!(
            self,
            Role::LeadSpeed
                | Role::RelativeSpeed
                | Role::LeadPosition
                | Role::LeadLength
                | Role::Lead2Speed
                | Role::Lead2Gap
                | Role::SinGrade
        )
    }

    /// With one row per time of cars one behind the other, each role with a column per car.
    fn in_platoon(self) -> bool {
        matches!(
            self,
            Role::Time
                | Role::Group
                | Role::Position
                | Role::Speed
                | Role::Acceleration
                | Role::Length
                | Role::Gap
                | Role::Headway
                | Role::SinGrade
        )
    }

    /// True if each car of a platoon has one.
    pub fn is_of_a_car(self) -> bool {
        self.in_platoon() && !matches!(self, Role::Time | Role::Group)
    }

    /// True if it gives the distance of the vehicle ahead.
    pub fn is_gap(self) -> bool {
        matches!(self, Role::Gap | Role::Headway)
    }

    /// With one row per time of a pair.
    fn in_pairs(self) -> bool {
        !matches!(self, Role::Id | Role::Ahead | Role::Length)
    }
}
