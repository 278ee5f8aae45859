//! The options for reading drives, in the form of Python and of the library.

use crate::UsageError;
use leadlag::Reading;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};

/// The name in Python of an option of the library.
fn named(option: &'static str) -> &'static str {
    match option {
        // A keyword of Python.
        "from" => "start",
        "to" => "end",
        other => other,
    }
}

/// The options of reading.
pub fn names() -> Vec<&'static str> {
    Reading::OPTIONS.map(named).to_vec()
}

/// The options of reading as texts, by their names; None values are left out.
pub fn options(given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, String)>> {
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
            options.push((name, path.unwrap_or(value).str()?.to_string()));
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
pub fn reading(options: &[(String, String)]) -> PyResult<Reading> {
    let mut reading = Reading::default();
    for (name, value) in options {
        let Some(option) = Reading::OPTIONS.into_iter().find(|option| named(option) == name) else {
            let known = names().join(", ");
            return Err(UsageError::new_err(format!("unknown option {name} of reading: expected {known}")));
        };
        reading.set(option, value).map_err(|error| UsageError::new_err(format!("{name}: {error}")))?;
    }
    Ok(reading)
}
