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

    /// The condition with its numbers, in words.
    #[must_use]
    pub fn in_words(&self) -> String {
        let digits = usize::from([self.value, self.limit].iter().any(|x| x.fract() != 0.0));
        let number = |x: f64| if x.abs() == f64::MAX { "infinite".to_owned() } else { format!("{x:.digits$}") };
        format!("{}: {}, limit {}", self.name, number(self.value), number(self.limit))
    }

    fn new(name: &str, value: f64, limit: f64, met: bool) -> Check {
        // JSON has only finite numbers.
        let finite = |x: f64| if x.is_nan() { f64::MAX } else { x.clamp(-f64::MAX, f64::MAX) };
        Check { name: name.to_owned(), value: finite(value), limit: finite(limit), met }
    }
}

#[cfg(test)]
mod tests {
    use super::Check;

    #[test]
    fn a_ratio_of_sizes_of_two_signs_is_infinite() {
        let said = Check::at_most("largest size over smallest", f64::INFINITY, 2.5).in_words();
        assert_eq!(said, "largest size over smallest: infinite, limit 2.5");
        assert_eq!(Check::at_least("gain", 0.04, 1.0).in_words(), "gain: 0.0, limit 1.0");
        assert_eq!(Check::at_most("collisions", 1.0, 0.0).in_words(), "collisions: 1, limit 0");
    }
}
