//! The keys of a column map in TOML.

use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;
use toml::Spanned;

/// Meaning of a row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "snake_case")]
#[serde(rename_all = "kebab-case")]
pub(super) enum Rows {
    /// One vehicle at one time.
    Vehicles,
    /// One time of a follower and the vehicle ahead of it.
    Pairs,
    /// One time of cars that drive one behind the other.
    Platoon,
}

/// Separator of fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Separator {
    #[default]
    Comma,
    Semicolon,
    Tab,
    /// Any number of blanks and tabs.
    Whitespace,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Decimal {
    #[default]
    Point,
    Comma,
}

/// The end of the positions towards which a vehicle drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Direction {
    #[default]
    Increasing,
    Decreasing,
    /// A vehicle with negative speeds drives towards lower positions.
    BySpeed,
    /// Speeds have no sign; a vehicle whose last position is the lower one drives towards lower positions.
    ByPosition,
}

/// The point of a vehicle that its position refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum PositionAt {
    #[default]
    Front,
    Centre,
    Rear,
    /// The end with the lower position, whichever way the vehicle drives (the corner of a bounding box).
    LowEnd,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Text {
    #[serde(default)]
    pub title: String,
    pub rows: Rows,
    #[serde(default)]
    pub separator: Separator,
    #[serde(default)]
    pub decimal: Decimal,
    pub header: Option<Vec<String>>,
    /// Options for a table without a header line.
    pub headerless: Option<Headerless>,
    #[serde(default)]
    pub skip_lines: u64,
    #[serde(default)]
    pub units_row: bool,
    #[serde(default)]
    pub missing: Vec<String>,
    #[serde(default)]
    pub nobody: Vec<String>,
    #[serde(default)]
    pub direction: Direction,
    #[serde(default)]
    pub position_at: PositionAt,
    #[serde(alias = "frame_rate")]
    pub frame_rate_hz: Option<f64>,
    #[serde(default = "yes")]
    pub check_units: bool,
    pub length: Option<f64>,
    pub lead_length: Option<f64>,
    pub lap_length: Option<f64>,
    pub columns: BTreeMap<Spanned<String>, Spanned<Entry>>,
    pub layout: Option<Fixed>,
}

/// A layout with fixed names and SI units: a misspelt name and a value that no car has are refused, and cars keep the numbers of the file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Fixed {
    /// Remedy if columns are missing.
    #[serde(default)]
    pub hint: String,
    /// Columns that belong to the layout and are not read.
    #[serde(default)]
    pub unread: Vec<String>,
    /// Columns of names that complete its cars.
    #[serde(default)]
    pub names: Vec<String>,
    /// Cars count from 1 without a break, and each has all columns.
    #[serde(default)]
    pub every_car: bool,
}

/// A table without a header line.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Headerless {
    pub separator: Separator,
    pub header: Vec<String>,
}

/// Value of a role.
pub(super) enum Entry {
    /// One value for all rows.
    Constant(f64),
    Column(Named),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Named {
    pub name: Names,
    pub unit: Option<String>,
    #[serde(default)]
    pub optional: bool,
    /// Remedy if the column is missing.
    #[serde(default)]
    pub hint: String,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a name, or a list of names of which a file has one")]
pub(super) enum Names {
    One(String),
    Several(Vec<String>),
}

impl<'de> Deserialize<'de> for Entry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Entry;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("{ name = \"...\" }, or a number that holds for all rows")
            }

            fn visit_f64<E>(self, value: f64) -> Result<Entry, E> {
                Ok(Entry::Constant(value))
            }

            fn visit_i64<E>(self, value: i64) -> Result<Entry, E> {
                Ok(Entry::Constant(value as f64))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Entry, A::Error> {
                Named::deserialize(MapAccessDeserializer::new(map)).map(Entry::Column)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

fn yes() -> bool {
    true
}
