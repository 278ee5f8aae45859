//! Meaning of a column of a mapped table.

use super::text::Rows;
use super::unit::Quantity;
use crate::trajectory::error::ProblemKind;
use crate::trajectory::import::number::{GRADE_LIMIT, POSITION_LIMIT, REVERSE_LIMIT, SPACING_LIMIT, SPEED_LIMIT};

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
    LeadAcceleration,
    Lead2Speed,
    Lead2Gap,
    /// A name that completes the cars of a layout.
    Name,
}

impl Role {
    /// The measured quantity; `None`: a name.
    pub fn quantity(self) -> Option<Quantity> {
        match self {
            Role::Id | Role::Ahead | Role::Group | Role::Lane | Role::Driver | Role::Name => None,
            Role::Time => Some(Quantity::Time),
            Role::Speed | Role::LeadSpeed | Role::RelativeSpeed | Role::Lead2Speed => Some(Quantity::Speed),
            Role::Acceleration | Role::LeadAcceleration => Some(Quantity::Acceleration),
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
                | Role::LeadAcceleration
                | Role::Lead2Speed
                | Role::Lead2Gap
                | Role::SinGrade
                | Role::Name
        )
    }

    /// With one row per time of cars one behind the other, each role with a column per car.
    fn in_platoon(self) -> bool {
        matches!(
            self,
            Role::Time
                | Role::Group
                | Role::Driver
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

    /// True if it is a distance of two vehicles.
    pub fn is_distance(self) -> bool {
        self.is_gap() || self == Role::Lead2Gap
    }

    /// A value that no car on a road has, in SI.
    pub fn limit(self, column: &str, found: f64) -> Option<ProblemKind> {
        let column = || column.to_owned();
        match (self, self.quantity()) {
            (_, Some(Quantity::Speed)) if found > SPEED_LIMIT => {
                Some(ProblemKind::SpeedTooHigh { column: column(), limit: SPEED_LIMIT, found })
            }
            (_, Some(Quantity::Speed)) if found < REVERSE_LIMIT => {
                Some(ProblemKind::SpeedNegative { column: column(), limit: REVERSE_LIMIT, found })
            }
            _ if self.is_distance() && found > SPACING_LIMIT => {
                Some(ProblemKind::TooLong { column: column(), limit: SPACING_LIMIT, found })
            }
            (Role::Position | Role::LeadPosition, _) if found.abs() > POSITION_LIMIT => {
                Some(ProblemKind::TooLong { column: column(), limit: POSITION_LIMIT, found })
            }
            (Role::SinGrade, _) if found.abs() > GRADE_LIMIT => {
                Some(ProblemKind::Grade { column: column(), limit: GRADE_LIMIT, found })
            }
            _ => None,
        }
    }

    /// With one row per time of a pair.
    fn in_pairs(self) -> bool {
        !matches!(self, Role::Id | Role::Ahead | Role::Length | Role::Name)
    }
}
