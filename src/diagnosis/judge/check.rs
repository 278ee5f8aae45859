//! A condition that is asked of a model, with what was found.

use serde::{Deserialize, Serialize};

/// A condition with what was found and what was needed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// What is asked.
    pub name: String,
    /// What was found.
    pub value: f64,
    /// What was needed.
    pub limit: f64,
    /// Whether it was met.
    pub met: bool,
}

impl Check {
    /// Met up to the limit.
    #[must_use]
    pub fn at_most(name: &str, value: f64, limit: f64) -> Check {
        Check::new(name, value, limit, value <= limit)
    }

    /// Met from the limit on.
    #[must_use]
    pub fn at_least(name: &str, value: f64, limit: f64) -> Check {
        Check::new(name, value, limit, value >= limit)
    }

    /// Met beyond the limit.
    #[must_use]
    pub fn above(name: &str, value: f64, limit: f64) -> Check {
        Check::new(name, value, limit, value > limit)
    }

    fn new(name: &str, value: f64, limit: f64, met: bool) -> Check {
        // JSON has finite numbers only.
        let finite = |x: f64| if x.is_nan() { f64::MAX } else { x.clamp(-f64::MAX, f64::MAX) };
        Check { name: name.to_owned(), value: finite(value), limit: finite(limit), met }
    }
}
