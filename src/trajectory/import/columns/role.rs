//! What a column of a mapped table says.

use super::map::Rows;
use super::unit::Quantity;

/// The role of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Role {
    Time,
    Id,
    Ahead,
    Group,
    Lane,
    Position,
    Speed,
    Acceleration,
    Length,
    Gap,
    Headway,
    SinGrade,
    LeadSpeed,
    LeadPosition,
    LeadLength,
    Lead2Speed,
    Lead2Gap,
}

impl Role {
    pub const ALL: [Role; 17] = [
        Role::Time,
        Role::Id,
        Role::Ahead,
        Role::Group,
        Role::Lane,
        Role::Position,
        Role::Speed,
        Role::Acceleration,
        Role::Length,
        Role::Gap,
        Role::Headway,
        Role::SinGrade,
        Role::LeadSpeed,
        Role::LeadPosition,
        Role::LeadLength,
        Role::Lead2Speed,
        Role::Lead2Gap,
    ];

    /// Its key in a map.
    pub fn name(self) -> &'static str {
        match self {
            Role::Time => "time",
            Role::Id => "id",
            Role::Ahead => "ahead",
            Role::Group => "group",
            Role::Lane => "lane",
            Role::Position => "position",
            Role::Speed => "speed",
            Role::Acceleration => "acceleration",
            Role::Length => "length",
            Role::Gap => "gap",
            Role::Headway => "headway",
            Role::SinGrade => "sin_grade",
            Role::LeadSpeed => "lead_speed",
            Role::LeadPosition => "lead_position",
            Role::LeadLength => "lead_length",
            Role::Lead2Speed => "lead2_speed",
            Role::Lead2Gap => "lead2_gap",
        }
    }

    /// What is measured; `None`: a name.
    pub fn quantity(self) -> Option<Quantity> {
        match self {
            Role::Id | Role::Ahead | Role::Group | Role::Lane => None,
            Role::Time => Some(Quantity::Time),
            Role::Speed | Role::LeadSpeed | Role::Lead2Speed => Some(Quantity::Speed),
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

    /// True if it makes sense in a table with such rows.
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

    /// True if there is one of each car of a platoon.
    pub fn is_of_a_car(self) -> bool {
        self.in_platoon() && !matches!(self, Role::Time | Role::Group)
    }

    /// True if it says how far the vehicle ahead is away.
    pub fn is_gap(self) -> bool {
        matches!(self, Role::Gap | Role::Headway)
    }

    /// With one row per time of a pair.
    fn in_pairs(self) -> bool {
        !matches!(self, Role::Id | Role::Ahead | Role::Length)
    }
}
