//! The distribution of parameters over drivers, from what the drives of each say (empirical Bayes).
//!
//! Parameters of a driver are normally distributed around the middle, and his drives say a normal distribution of them. The spread is that of
//! the largest restricted likelihood (H. D. Patterson and R. Thompson, 1971), which is 0 if estimates differ no more than by their noise.

use nalgebra::{DMatrix, DVector};

/// Spreads that are tried, as shares of the axis: 0, and from the largest on, each smaller by this factor.
const LARGEST: f64 = 0.5;
/// See [`LARGEST`].
const FACTOR: f64 = 0.7;
/// See [`LARGEST`].
const TRIED: i32 = 20;
/// Steps of a golden section between two of them, to a ten thousandth of their distance.
const SECTIONS: usize = 20;
/// Rounds over the spreads: they hardly depend on each other.
const ROUNDS: usize = 3;
/// Fall of the logarithm of a likelihood at the ends of a 95 % interval: half the quantile of χ² with one degree of freedom.
const FALL: f64 = 1.92;
/// Quantile of the normal distribution for 95 %, two-sided.
const TWO_SIDED: f64 = 1.96;
/// Share of the largest information that is added where drives say nothing.
const RIDGE: f64 = 1e-9;

/// What the drives of a driver say of his parameters p: a density in proportion to exp(`vector`ᵀ p - pᵀ `matrix` p / 2).
#[derive(Debug, Clone)]
pub struct Evidence {
    pub matrix: DMatrix<f64>,
    pub vector: DVector<f64>,
}

/// A normal distribution over drivers, parameter by parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    pub middle: Vec<f64>,
    /// 95 % intervals of the middles.
    pub middle_interval: Vec<[f64; 2]>,
    /// Standard deviations.
    pub spread: Vec<f64>,
    /// 95 % intervals of the spreads.
    pub spread_interval: Vec<[f64; 2]>,
}

impl Distribution {
    /// The distribution of the parameters of these drivers, of which there are `n`.
    #[must_use]
    pub fn of(evidence: &[Evidence], n: usize) -> Distribution {
        let mut spread = vec![0.0; n];
        for k in (0..ROUNDS).flat_map(|_| 0..n) {
            spread[k] = highest(&|x| Profile::at(evidence, &with(&spread, k, x)).likelihood);
        }
        let found = Profile::at(evidence, &spread);
        let interval = |k: usize| {
            let falls = |x: f64| Profile::at(evidence, &with(&spread, k, x)).likelihood < found.likelihood - FALL;
            [end(&falls, spread[k], 0.0), end(&falls, spread[k], LARGEST)]
        };
        let error = |k: usize| TWO_SIDED * found.errors[(k, k)].max(0.0).sqrt();
        Distribution {
            middle: found.middle.iter().copied().collect(),
            middle_interval: (0..n).map(|k| [found.middle[k] - error(k), found.middle[k] + error(k)]).collect(),
            spread_interval: (0..n).map(interval).collect(),
            spread,
        }
    }
}

fn with(spread: &[f64], k: usize, value: f64) -> Vec<f64> {
    let mut spread = spread.to_vec();
    spread[k] = value;
    spread
}

/// The spread with the highest likelihood.
fn highest(likelihood: &dyn Fn(f64) -> f64) -> f64 {
    let mut tried: Vec<f64> = (0..TRIED).rev().map(|k| LARGEST * FACTOR.powi(k)).collect();
    tried.insert(0, 0.0);
    let values: Vec<f64> = tried.iter().map(|x| likelihood(*x).max(f64::NEG_INFINITY)).collect();
    let best = (0..tried.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])).expect("some are tried");
    if best == 0 {
        return 0.0;
    }
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let [mut low, mut high] = [tried[best - 1], tried[(best + 1).min(tried.len() - 1)]];
    for _ in 0..SECTIONS {
        let [a, b] = [high - golden * (high - low), low + golden * (high - low)];
        if likelihood(a) > likelihood(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

/// Where, from a spread towards a limit, the likelihood falls too low; the limit if it does not.
fn end(falls: &dyn Fn(f64) -> bool, from: f64, limit: f64) -> f64 {
    if !falls(limit) {
        return limit;
    }
    let [mut inside, mut outside] = [from, limit];
    for _ in 0..SECTIONS {
        let middle = 0.5 * (inside + outside);
        if falls(middle) { outside = middle } else { inside = middle }
    }
    inside
}

/// The best middle for some spreads.
struct Profile {
    likelihood: f64,
    middle: DVector<f64>,
    /// Covariance of the middle.
    errors: DMatrix<f64>,
}

impl Profile {
    fn at(evidence: &[Evidence], spread: &[f64]) -> Profile {
        let n = spread.len();
        let variance = DMatrix::from_diagonal(&DVector::from_iterator(n, spread.iter().map(|x| x * x)));
        let (mut information, mut vector) = (DMatrix::zeros(n, n), DVector::zeros(n));
        let mut drivers = Vec::with_capacity(evidence.len());
        for own in evidence {
            // (I + H T)⁻¹: what remains of the information on the middle if drivers differ.
            let lu = (DMatrix::identity(n, n) + &own.matrix * &variance).lu();
            let Some(remains) = lu.try_inverse() else { continue };
            information += &remains * &own.matrix;
            vector += &remains * &own.vector;
            drivers.push((own, lu.determinant(), remains));
        }
        let ridge = RIDGE * information.diagonal().max().max(f64::MIN_POSITIVE);
        information += DMatrix::identity(n, n) * ridge;
        let determinant = information.determinant();
        let errors = information.try_inverse().unwrap_or_else(|| DMatrix::zeros(n, n));
        let middle = &errors * vector;
        let mut likelihood = -0.5 * determinant.max(f64::MIN_POSITIVE).ln();
        for (own, determinant, remains) in drivers {
            let rest = &own.vector - &own.matrix * &middle;
            likelihood += -0.5 * determinant.ln() + 0.5 * rest.dot(&(&variance * remains * &rest));
            likelihood += own.vector.dot(&middle) - 0.5 * middle.dot(&(&own.matrix * &middle));
        }
        Profile { likelihood, middle, errors }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Estimates with an error of 0.05 of drivers around 0.4 with this spread; of a second parameter, drives say nothing.
    fn evidence(spread: f64) -> Vec<Evidence> {
        // A made-up sequence with a mean of 0 and a standard deviation of 1.
        let uniform = |k: usize, by: f64| (by * k as f64).fract() - 0.5;
        let normal = |k: usize, by: f64| 12.0_f64.sqrt() * uniform(k, by);
        let precision = 1.0 / (0.05 * 0.05);
        let one = |k: usize| {
            let estimate = 0.4 + spread * normal(k, 0.618_034) + 0.05 * normal(k, 0.324_718);
            let matrix = DMatrix::from_diagonal(&DVector::from_vec(vec![precision, 0.0]));
            Evidence { matrix, vector: DVector::from_vec(vec![precision * estimate, 0.0]) }
        };
        (1..=200).map(one).collect()
    }

    #[test]
    fn a_spread_is_that_beyond_the_noise() {
        for spread in [0.1, 0.03] {
            let found = Distribution::of(&evidence(spread), 2);
            assert!((found.middle[0] - 0.4).abs() < 0.01, "{found:?}");
            let [low, high] = found.spread_interval[0];
            assert!(low < spread && spread < high && high < 2.0 * spread, "{spread}: {found:?}");
            assert!((found.spread[0] / spread - 1.0).abs() < 0.2, "{spread}: {found:?}");
            // Nothing is known of the second.
            assert_eq!((found.spread_interval[1], found.middle[1]), ([0.0, LARGEST], 0.0));
        }
        let none = Distribution::of(&evidence(0.0), 2);
        assert!(none.spread[0] < 0.01 && none.spread_interval[0][0] == 0.0, "{none:?}");
        let [low, high] = none.middle_interval[0];
        assert!(low < 0.4 && 0.4 < high && high - low < 0.02, "{none:?}");
    }
}
