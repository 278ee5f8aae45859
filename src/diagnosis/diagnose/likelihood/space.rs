//! Parameters as a search uses them: coordinates from 0 to 1 between bounds.

use crate::diagnose::policy::POLICY;

/// One parameter: its bounds and its scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Lower bound.
    pub lower: f64,
    /// Upper bound, not below the lower one; equal bounds fix the parameter.
    pub upper: f64,
    /// True for a logarithmic scale; needs bounds of one sign.
    pub log: bool,
    /// Finite-difference step as a share of the range; 0 if no derivative is needed.
    pub step: f64,
}

/// Finite-difference step of parameters on which the innovations depend smoothly: f64 innovations are accurate to some 1e-12.
const SMOOTH: f64 = 1e-5;

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn linear(lower: f64, upper: f64) -> Axis {
        Axis { lower, upper, log: false, step: SMOOTH }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn log(lower: f64, upper: f64) -> Axis {
        Axis { lower, upper, log: true, step: SMOOTH }
    }

    /// A parameter held at a value, without a derivative.
    #[must_use]
    pub fn held(value: f64) -> Axis {
        Axis { step: 0.0, ..Axis::linear(value, value) }
    }

    /// True if the axis is [held](Axis::held).
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.step == 0.0
    }

    /// The value at a coordinate.
    #[must_use]
    pub fn value(&self, u: f64) -> f64 {
        let u = u.clamp(0.0, 1.0);
        let value = if self.log {
            self.lower * (self.upper / self.lower).powf(u)
        } else {
            self.lower + u * (self.upper - self.lower)
        };
        value.clamp(self.lower, self.upper)
    }

    /// Derivative of the value in its coordinate; on a bound, that of the neighbouring value.
    #[must_use]
    pub fn slope(&self, u: f64) -> f64 {
        const STEP: f64 = 1e-6;
        let (below, above) = (u - STEP, u + STEP);
        // An axis ends at 0 and 1: on a bound the difference is one-sided.
        let spanned = 2.0 * STEP - (0.0 - below).max(0.0) - (above - 1.0).max(0.0);
        (self.value(above) - self.value(below)) / spanned
    }

    /// The coordinate of a value; 0 for a fixed parameter.
    #[must_use]
    pub fn coordinate(&self, value: f64) -> f64 {
        if self.is_fixed() {
            return 0.0;
        }
        let value = value.clamp(self.lower, self.upper);
        if self.log {
            (value / self.lower).ln() / (self.upper / self.lower).ln()
        } else {
            (value - self.lower) / (self.upper - self.lower)
        }
    }

    /// Distance of a coordinate from that of a value larger or smaller by this share, whichever is farther.
    #[must_use]
    pub fn distance(&self, u: f64, share: f64) -> f64 {
        let value = self.value(u);
        let [below, above] = [1.0 - share, 1.0 + share].map(|factor| (self.coordinate(factor * value) - u).abs());
        below.max(above)
    }

    /// True if the bounds are equal.
    #[must_use]
    pub fn is_fixed(&self) -> bool {
        self.lower >= self.upper
    }

    /// True if the search does not distinguish two values.
    #[must_use]
    pub fn same(&self, a: f64, b: f64) -> bool {
        (self.coordinate(a) - self.coordinate(b)).abs() < POLICY.same
    }

    /// Distance of a value from the nearer bound, as a share of the range.
    #[must_use]
    pub fn from_bound(&self, value: f64) -> f64 {
        let u = self.coordinate(value);
        u.min(1.0 - u)
    }

    /// True if a value lies on a bound; never for a fixed parameter.
    #[must_use]
    pub fn at_bound(&self, value: f64) -> bool {
        !self.is_fixed() && self.from_bound(value) < POLICY.same
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_read_back() {
        for axis in [Axis::linear(-2.0, 6.0), Axis::log(0.01, 5.0), Axis::log(-5.0, -0.1)] {
            for u in [0.0, 0.3, 1.0] {
                assert!((axis.coordinate(axis.value(u)) - u).abs() < 1e-12, "{axis:?}");
            }
            assert!(axis.at_bound(axis.lower) && axis.at_bound(axis.upper) && !axis.at_bound(axis.value(0.5)));
        }
        assert_eq!(Axis::linear(2.0, 2.0).coordinate(2.0), 0.0);
        assert_eq!(Axis::linear(2.0, 2.0).value(0.7), 2.0);
    }

    #[test]
    fn a_slope_at_a_bound_is_that_beside_it() {
        let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-4, "{found}, {expected}");
        let (linear, log) = (Axis::linear(2.0, 6.0), Axis::log(0.01, 5.0));
        let ratio = (5.0_f64 / 0.01).ln();
        for u in [0.0, 4e-7, 0.3, 1.0 - 4e-7, 1.0] {
            near(linear.slope(u), 4.0);
            near(log.slope(u), ratio * log.value(u));
        }
    }
}
