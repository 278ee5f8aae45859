//! Results of a calibration besides the optimum: the uncertainty of each parameter, and the parameters that compensate for each other.
//!
//! The residuals of a free simulation are far from independent: at ten samples a second, each nearly repeats the previous one. So samples
//! are never counted as independent here.
//!
//! `local` has the score near its minimum as a quadratic form, by differences in f64, and the displacement of
//! the minimum by the noise of the drive (`noise`). Their covariance gives intervals and correlations.
//!
//! The intervals hold if the variant is right and the drive typical; they do not prove that it is right.

mod local;
mod noise;

use crate::calibrate::SearchSpace;
use crate::evaluator::{Case, EvaluateError, Evaluator, Score};
use crate::lanes::{Lanes, LanesPrecision};
use crate::rescore;
use crate::symbols::Symbol;
use local::Weights;
use nalgebra::{DMatrix, DVector};

/// Share of cases in which an interval should contain the true value.
pub const CONFIDENCE: f64 = 0.95;

/// Quantile of the normal distribution for [`CONFIDENCE`], two-sided.
const NORMAL: f64 = 1.959_963_985;

/// A drive determines a parameter if the interval excludes at least this share of the searched range.
const LEFT_OUT: f64 = 0.5;

/// Interval of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knowledge {
    /// The parameter.
    pub symbol: Symbol,
    /// Lower and upper end of the interval, in the parameter's unit.
    pub interval: [f64; 2],
    /// True if the bound of the search limits an end, and not the data.
    pub open: [bool; 2],
    /// False if the interval holds more than half of the searched range: the drive does not determine the value.
    pub determined: bool,
    /// Equivalent number of independent samples, all signals of one time together.
    pub effective_samples: f64,
    /// Rise of the score at which the interval ends, in units of the score.
    pub rise: f64,
}

/// Part of the autocorrelated noise of a drive that the parameters have followed.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Optimism {
    /// Expected increase of the score on another drive of the same driver, in units of the score; in proportion to the noise.
    pub score: f64,
    /// The noise under the model: mean square of the speed that an unknown acceleration adds in some seconds \[m²/s²\]. Errors of the model
    /// count as noise, too.
    pub noise: f64,
}

/// Intervals and correlations of all searched parameters.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Identifiability {
    /// One entry per searched parameter; empty if it could not be computed, see `note`.
    pub parameters: Vec<Knowledge>,
    /// Correlations between the errors of these, row by row; 0 beside a parameter without effect.
    pub correlation: Vec<Vec<f64>>,
    /// Expected increase of the score on another drive of the same driver; `None` if it could not be computed.
    pub optimism: Option<Optimism>,
    /// Why there are no intervals.
    pub note: Option<&'static str>,
    /// Simulated candidates.
    pub evaluations: u64,
}

/// The f64 evaluator that computes the effect of disturbances, and the positions of the other evaluator's cases among its own.
#[derive(Debug, Clone, Copy)]
pub struct Exactly<'a> {
    /// It has all requested cases.
    pub lanes: &'a Lanes,
    /// The first of them.
    pub first: usize,
    /// Their number.
    pub count: usize,
}

impl<'a> Exactly<'a> {
    fn cases(self) -> &'a [Case] {
        &self.lanes.cases()[self.first..self.first + self.count]
    }
}

/// Computes the uncertainty of the parameters of a calibrated candidate.
///
/// # Errors
/// When the evaluator in f64 fails.
pub fn identify(
    evaluator: &dyn Evaluator,
    space: &SearchSpace,
    candidate: &[f64],
    stop: &mut dyn FnMut() -> bool,
) -> Result<Identifiability, EvaluateError> {
    let lanes = Lanes::new(evaluator.cases().to_vec(), *evaluator.gof(), LanesPrecision::F64)?;
    identify_on(Exactly { lanes: &lanes, first: 0, count: evaluator.cases().len() }, space, candidate, stop)
}

/// Drives below this are too short for reliable intervals \[s\].
pub const SHORT_S: f64 = 60.0;
/// The caution beside intervals of such drives; the table of `docs/benchmark/optimizers.md` has the shares.
pub const SHORT: &str = "on drives of less than 60 s with autocorrelated noise, 95 % intervals contained the truth in 89 (v_0) and 86 (d_0) of 100 cases";

/// The same for some of the cases of an evaluator in f64.
///
/// # Errors
/// As [`identify`].
pub fn identify_on(
    exactly: Exactly<'_>,
    space: &SearchSpace,
    candidate: &[f64],
    stop: &mut dyn FnMut() -> bool,
) -> Result<Identifiability, EvaluateError> {
    let none = |note, evaluations| Ok(Identifiability { note: Some(note), evaluations, ..Identifiability::default() });
    let local = match local::Local::new(exactly, space, candidate, Weights::OfScore, stop)? {
        Ok(local) => local,
        Err(refused) => return none(refused.note, refused.evaluations),
    };
    let mut spreads: Vec<local::Spread> = (0..local.free.len()).map(|k| local.spread(k)).collect();
    let rises = spreads.iter().map(|s| s.rise).filter(|rise| rise.is_finite() && *rise > 0.0);
    let Some(deepest) = rises.reduce(f64::min) else {
        return none("no parameter changes the score", local.evaluations());
    };
    // A parameter without effect never raises the score.
    for spread in spreads.iter_mut().filter(|s| !(s.rise.is_finite() && s.rise > 0.0)) {
        spread.rise = deepest;
    }
    // A tenth of the rise: it shifts an interval by less than a tenth of its half width.
    let score = |values: &[f64]| -> Result<f64, EvaluateError> {
        Ok(match rescore::score(exactly.cases(), exactly.lanes.gof(), &space.parameters(values))? {
            Score::Value(value) => value,
            _ => f64::INFINITY,
        })
    };
    if score(&local.lowest(space, candidate))? < score(candidate)? - 0.1 * deepest {
        let note = "the candidate is not at a minimum: a better one is near, so search longer";
        return none(note, local.evaluations() + 1);
    }
    let parameters = spreads.iter().zip(&local.free).map(|(spread, &i)| {
        let ([lower, upper], x) = (space.bounds[i], candidate[i]);
        let ends = ends(x, spread.half * (upper - lower), [lower, upper]);
        let interval = ends.map(|end| end.clamp(lower, upper));
        Knowledge {
            symbol: space.symbols[i],
            interval,
            open: [ends[0] < lower, ends[1] > upper],
            determined: space.share_of_range(i, interval) <= 1.0 - LEFT_OUT,
            effective_samples: spread.effective_samples,
            rise: spread.rise,
        }
    });
    let parameters: Vec<Knowledge> = parameters.collect();
    let seconds: f64 = exactly.cases().iter().map(|case| case.s.len() as f64 * case.dt).sum();
    let note = (seconds < SHORT_S && parameters.iter().any(|one| one.determined)).then_some(SHORT);
    let on_bound = space.at_bound(candidate);
    let inside: Vec<bool> = local.free.iter().map(|&i| !on_bound.contains(&space.symbols[i])).collect();
    let optimism = local.optimism(&inside);
    Ok(Identifiability {
        parameters,
        correlation: local.correlation(),
        optimism,
        note,
        evaluations: local.evaluations() + 1,
    })
}

/// What drives say of the searched parameters near a candidate, with p the displacements from it as shares of their ranges: a density in
/// proportion to exp(`vector`ᵀ p - pᵀ `matrix` p / 2). Zeros for a parameter without effect, and none in directions that are flat.
#[derive(Debug, Clone, PartialEq)]
pub struct Information {
    /// Inverse of the covariance of the estimates.
    pub matrix: DMatrix<f64>,
    /// The matrix times the estimates.
    pub vector: DVector<f64>,
    /// Second derivatives of the score, with the weights of the squared residuals at the candidate.
    pub curvature: DVector<f64>,
}

/// The information of some cases, which need not have their minimum at the candidate; `None` if the score has no quadratic form there.
///
/// # Errors
/// As [`identify`].
pub fn information(
    exactly: Exactly<'_>,
    space: &SearchSpace,
    candidate: &[f64],
    stop: &mut dyn FnMut() -> bool,
) -> Result<Option<Information>, EvaluateError> {
    let local = local::Local::new(exactly, space, candidate, Weights::Fixed, stop)?;
    Ok(local.ok().and_then(|local| local.information()))
}

/// Ends of an interval of this half width around the value. If the bounds of a parameter exclude 0, its error grows with the value, so the
/// end away from 0 is a multiple of the value; the other end stays a difference, which gives the wider interval there.
fn ends(x: f64, half: f64, [lower, upper]: [f64; 2]) -> [f64; 2] {
    let far = x * (half / x.abs()).exp();
    if lower > 0.0 {
        [x - half, far]
    } else if upper < 0.0 {
        [far, x + half]
    } else {
        [x - half, x + half]
    }
}

/// Quantile of Student's t distribution for [`CONFIDENCE`]: the first terms of the expansion of E. A. Cornish and R. A. Fisher (1938);
/// accurate to 1 % from 4 degrees of freedom on, and not used for fewer.
#[must_use]
pub fn student(freedom: f64) -> f64 {
    let (z, nu) = (NORMAL, freedom.max(4.0));
    let (z3, z5, z7) = (z.powi(3), z.powi(5), z.powi(7));
    z + (z3 + z) / (4.0 * nu)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * nu * nu)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * nu.powi(3))
}

#[cfg(test)]
mod tests {
    use super::{ends, student};

    #[test]
    fn the_quantiles_are_those_of_the_tables() {
        for (freedom, expected) in [(4.0, 2.776), (5.0, 2.571), (10.0, 2.228), (30.0, 2.042), (1e9, 1.960)] {
            assert!((student(freedom) / expected - 1.0).abs() < 0.01, "{freedom}: {}", student(freedom));
        }
    }

    #[test]
    fn intervals_of_what_cannot_be_zero_reach_farther_away_from_it() {
        let e = 0.5_f64.exp();
        assert_eq!(ends(2.0, 1.0, [0.1, 8.0]), [1.0, 2.0 * e]);
        assert_eq!(ends(-2.0, 1.0, [-6.0, -0.1]), [-2.0 * e, -1.0]);
        assert_eq!(ends(0.3, 0.5, [0.0, 1.5]), [0.3 - 0.5, 0.8]);
    }
}
