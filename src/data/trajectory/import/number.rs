//! One field of a table: a number, or its fault.

use crate::trajectory::error::ProblemKind;
use std::hash::{DefaultHasher, Hasher};

/// A speed above this is in another unit \[m/s\] (324 km/h).
pub(super) const SPEED_LIMIT: f64 = 90.0;
/// A speed below this is not sensor noise at standstill \[m/s\].
pub(super) const REVERSE_LIMIT: f64 = -0.5;
/// No car follows another one at a larger distance \[m\].
pub(super) const SPACING_LIMIT: f64 = 1e4;
/// No road is longer \[m\]; beyond it a double no longer resolves fractions of a millimetre anyway.
pub(in crate::trajectory) const POSITION_LIMIT: f64 = 1e9;
/// The sine of no road's grade is beyond this.
pub(in crate::trajectory) const GRADE_LIMIT: f64 = 0.5;

/// Key that distinguishes a row from another one with the same time.
pub(super) fn fingerprint(line: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(line.as_bytes());
    hasher.finish()
}

/// Marks of missing values in the output of common programs.
const MISSING: [&str; 8] = ["", "nan", "na", "n/a", "#n/a", "null", "none", "-"];

/// True for an empty field, and for a word that means the same.
pub(in crate::trajectory) fn is_missing(text: &str) -> bool {
    MISSING.iter().any(|word| text.eq_ignore_ascii_case(word))
}

/// A number, NaN if it is missing, or its fault.
pub(in crate::trajectory) fn finite(text: &str, column: &str) -> Result<f64, ProblemKind> {
    if is_missing(text) {
        return Ok(f64::NAN);
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ if decimal_comma(text) => {
            Err(ProblemKind::DecimalComma { column: column.to_owned(), found: text.to_owned(), mapped: false })
        }
        _ => Err(ProblemKind::NotANumber { column: column.to_owned(), found: text.to_owned(), optional: true }),
    }
}

/// A number that must be there.
pub(in crate::trajectory) fn present(text: &str, column: &str) -> Result<f64, ProblemKind> {
    match finite(text, column) {
        Ok(value) if value.is_nan() => Err(ProblemKind::Missing { column: column.to_owned() }),
        Err(ProblemKind::NotANumber { column, found, .. }) => {
            Err(ProblemKind::NotANumber { column, found, optional: false })
        }
        result => result,
    }
}

fn decimal_comma(text: &str) -> bool {
    text.matches(',').count() == 1 && text.replace(',', ".").parse::<f64>().is_ok()
}
