//! Tests which of several models predicts better, on the differences of their losses, bin by bin. Independent of cars.
//!
//! A loss table has one row per model and one column per bin; bins lie in segments (drives), within which neighbours depend on each
//! other. [`Resamples`] draws bins by the stationary bootstrap; the tests share these draws.

mod bootstrap;
mod check;
mod confidence_set;
mod step_down;

pub use bootstrap::{Draw, Resamples};
pub use check::Check;
pub use confidence_set::confidence_set;
pub use step_down::{Adjusted, critical, step_down};

/// Mean of some numbers; 0 without any.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    crate::statistics::mean(values).unwrap_or(0.0)
}
