//! A check of a model, with its value and limit.

use serde::{Deserialize, Serialize};

/// A check with its value and limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// The quantity that is checked.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its limit.
    pub limit: f64,
    /// Whether the check passed.
    pub met: bool,
}

impl Check {
    /// Passes up to the limit.
    #[must_use]
    pub fn at_most(name: &str, value: f64, limit: f64) -> Check {
        Check::new(name, value, limit, value <= limit)
    }

    /// Passes from the limit on.
    #[must_use]
    pub fn at_least(name: &str, value: f64, limit: f64) -> Check {
        Check::new(name, value, limit, value >= limit)
    }

    /// Passes above the limit.
    #[must_use]
    pub fn above(name: &str, value: f64, limit: f64) -> Check {
        Check::new(name, value, limit, value > limit)
    }

    fn new(name: &str, value: f64, limit: f64, met: bool) -> Check {
        // JSON has only finite numbers.
        let finite = |x: f64| if x.is_nan() { f64::MAX } else { x.clamp(-f64::MAX, f64::MAX) };
        Check { name: name.to_owned(), value: finite(value), limit: finite(limit), met }
    }
}
