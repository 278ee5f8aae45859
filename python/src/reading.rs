//! The options for reading drives, in the form of Python and of the library.

use crate::UsageError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};

/// The options of reading.
pub const OPTIONS: [&str; 15] = [
    "columns",
    "layout",
    "trajectory",
    "segment",
    "start",
    "end",
    "max_gap",
    "smooth",
    "correct",
    "resample",
    "reconcile",
    "vehicle",
    "grade",
    "lead_length",
    "lead_start",
];

/// A value of an option.
#[derive(Clone, FromPyObject, IntoPyObject)]
pub enum Setting {
    Flag(bool),
    Whole(i64),
    Number(f64),
    Text(String),
}

/// The options of reading, by their names; None values are left out, and paths are texts.
pub fn options(given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, Setting)>> {
    let mut options = Vec::new();
    for (name, value) in given.into_iter().flatten() {
        if !value.is_none() {
            let name: String = name.extract()?;
            // A column map in a mapping is the text of one.
            let value = match value.cast::<PyMapping>() {
                Ok(map) if name == "columns" => map.py().import("leadlag._frames")?.call_method1("map_text", (map,))?,
                _ => value,
            };
            let path = value.hasattr("__fspath__")?.then(|| value.call_method0("__fspath__")).transpose()?;
            let value = path.unwrap_or(value);
            let told = || format!("{name}: expected a number, a text or True, found {value}");
            options.push((name.clone(), value.extract().map_err(|_| UsageError::new_err(told()))?));
        }
    }
    Ok(options)
}

/// A follower by number, name or id.
#[derive(FromPyObject)]
pub enum Follower {
    Number(u64),
    Name(String),
}

impl Follower {
    pub fn text(self) -> String {
        match self {
            Follower::Number(number) => number.to_string(),
            Follower::Name(name) => name,
        }
    }
}

/// The same in the form of the library.
pub fn reading(options: &[(String, Setting)]) -> PyResult<leadlag::Reading> {
    let mut reading = leadlag::Reading::default();
    for (name, value) in options {
        let text = || match value {
            Setting::Text(text) => Ok(text.clone()),
            Setting::Whole(number) => Ok(number.to_string()),
            _ => Err(wrong(name, "a text")),
        };
        let number = || match value {
            Setting::Number(number) => Ok(*number),
            Setting::Whole(number) => Ok(*number as f64),
            _ => Err(wrong(name, "a number")),
        };
        match name.as_str() {
            "layout" => {
                reading.layout = Some(text()?.parse().map_err(|error| UsageError::new_err(format!("{error}")))?)
            }
            "columns" => reading.columns = Some(text()?),
            "trajectory" => reading.trajectory = Some(text()?),
            "segment" => {
                let segment = match value {
                    Setting::Whole(segment) => u32::try_from(*segment).ok().filter(|segment| *segment > 0),
                    _ => None,
                };
                reading.segment = Some(segment.ok_or_else(|| wrong(name, "a whole number from 1 on"))?);
            }
            "start" => reading.from = Some(number()?),
            "end" => reading.to = Some(number()?),
            "max_gap" => reading.max_gap_s = number()?,
            "smooth" | "correct" => {
                let Setting::Flag(wanted) = value else { return Err(wrong(name, "True or False")) };
                *(if name == "smooth" { &mut reading.smooth } else { &mut reading.correct }) = *wanted;
            }
            "resample" => reading.resample_s = Some(number()?),
            "reconcile" => {
                reading.reconcile = text()?.parse().map_err(|error| UsageError::new_err(format!("{error}")))?
            }
            "vehicle" => reading.vehicle = Some(text()?),
            "grade" => reading.grade = Some(text()?),
            "lead_length" => reading.lead_length_m = Some(number()?),
            "lead_start" => reading.lead_start_m = Some(number()?),
            _ => {
                let known = OPTIONS.join(", ");
                return Err(UsageError::new_err(format!("unknown option {name} of reading: expected {known}")));
            }
        }
    }
    Ok(reading)
}

/// Error for an option with the wrong kind of value.
pub fn wrong(name: &str, expected: &str) -> PyErr {
    UsageError::new_err(format!("{name}: expected {expected}"))
}
