//! Bounds of parameters from a file: what cannot be is told with file and line.

use super::Usage;
use leadlag::calibrate::{self, BoundsError, Overrides};
use leadlag::catalog::Variant;
use std::path::Path;

/// The bounds of a file for the parameters of a variant.
pub fn read_bounds(path: &Path, variant: &Variant) -> anyhow::Result<Overrides> {
    calibrate::read_bounds(path, variant).map_err(|error| match error {
        BoundsError::Impossible { name, expected, lower, upper } => {
            let place = place(path, name);
            let message = if lower > upper {
                format!("{place}: {name}: the lower bound {lower} is above the upper bound {upper}; swap them")
            } else {
                format!("{place}: {name}: expected {expected} as both bounds, found [{lower}, {upper}]")
            };
            Usage(message).into()
        }
        other => other.into(),
    })
}

/// `FILE:LINE` of an entry; the file alone where it stands in no line of its own.
fn place(path: &Path, name: &str) -> String {
    let shown = path.display();
    let text = leadlag::bounded::read_to_string(path, leadlag::bounded::TEXT_MAX).unwrap_or_default();
    let is_entry =
        |line: &str| line.split_once('=').is_some_and(|(key, _)| key.trim().trim_matches(['"', '\'']) == name);
    let line = text.lines().position(is_entry);
    line.map_or_else(|| shown.to_string(), |line| format!("{shown}:{}", line + 1))
}
