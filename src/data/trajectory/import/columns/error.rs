//! Faults of a column map.

use crate::trajectory::grade::LAPS_M;
use std::io;

/// A column map that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    #[error("{path}: expected a readable column map")]
    Open { path: String, source: io::Error },
    #[error(
        "no column map {name}; built in are {}, your own map ends in .toml{}",
        known.join(", "),
        did_you_mean(near.as_deref())
    )]
    Unknown { name: String, known: Vec<&'static str>, near: Option<String> },
    #[error("{path}:{line}:{column}: {message}")]
    Text { path: String, line: usize, column: usize, message: String },
    #[error("{path}:{line}: [columns] has no {found}; it takes {}{}", known.join(", "), did_you_mean(near.as_deref()))]
    Role { path: String, line: usize, found: String, known: Vec<&'static str>, near: Option<String> },
    #[error("{path}:{line}: {role}: expected a name of a column, found none; write {role} = {{ name = \"...\" }}")]
    NoName { path: String, line: usize, role: &'static str },
    #[error(
        "{path}:{line}: {role}: expected a column, {role} = {{ name = \"...\" }}, found a number; only length and lead_length may be numbers"
    )]
    Constant { path: String, line: usize, role: &'static str },
    #[error("{path}: {key}: expected {lowest} to {highest} m, found {found}")]
    Length { path: String, key: &'static str, found: f64, lowest: f64, highest: f64 },
    #[error("{path}: lap_length: expected {} to {} m, found {found}", LAPS_M.start(), LAPS_M.end())]
    Lap { path: String, found: f64 },
    #[error("{path}:{line}: {role}: expected one of the units {}, found {found}", known.join(", "))]
    Unit { path: String, line: usize, role: &'static str, found: String, known: Vec<&'static str> },
    #[error("{path}:{line}: {role}: expected no unit, because it is a name; found {found}")]
    UnitOfName { path: String, line: usize, role: &'static str, found: String },
    #[error("{path}:{line}: {role}: not in a table with rows = \"{rows}\", which takes {}", known.join(", "))]
    Misplaced { path: String, line: usize, role: &'static str, rows: &'static str, known: Vec<&'static str> },
    #[error(
        "{path}: {role}: expected a name with {{}} for the number of the car, such as {role} = {{ name = \"{role}{{}}\" }}, found {found}: \
         every car of a platoon has its own column"
    )]
    NoNumber { path: String, role: &'static str, found: String },
    #[error("{path}: [columns] needs {needed}, found only {}; {why}", found.join(", "))]
    Missing { path: String, needed: &'static str, found: Vec<&'static str>, why: &'static str },
    #[error("{path}: time is in frames, so the map needs their rate: frame_rate_hz = 25")]
    NoRate { path: String },
    #[error(
        "{path}: decimal = \"comma\": expected another separator than the comma; set separator to semicolon, tab or whitespace"
    )]
    TwoCommas { path: String },
    #[error("{path}: frame_rate_hz: expected 0.2 to 1000 per second, found {found}")]
    Rate { path: String, found: f64 },
}

fn did_you_mean(near: Option<&str>) -> String {
    near.map_or_else(String::new, |near| format!("; did you mean {near}?"))
}
