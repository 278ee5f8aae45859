//! What a calibration tells besides the optimum: how well each parameter is known, and which ones make up for each other.
//!
//! The residuals of a free simulation are far from independent: at ten samples a second one tells nearly what the next one tells.
//! So nothing here counts samples as if each were new.
//!
//! 1. `local`: the score near its minimum as a quadratic form, by differences of the f64 reference. The drive is cut into blocks, and the
//!    variance of a parameter is told by how differently they pull its minimum.
//! 2. `profile`: each parameter is moved away and all others are calibrated again. The interval ends where the score has risen by
//!    what a parameter of that variance explains by chance in 95 of 100 cases (J. T. Kent, Biometrika 69, 1982: the profile of a
//!    score that is no likelihood). It need not be symmetric, and it ends at a bound where the data do not end it.
//! 3. `near`: correlations between parameters among the candidates that are nearly as good as the best.
//!
//! The intervals say what is known if the variant is right and the drive typical; they do not say that it is right.

mod local;
mod near;
mod profile;

pub use near::correlation;

use crate::calibrate::SearchSpace;
use crate::evaluator::{EvaluateError, Evaluator};
use crate::lanes::{Lanes, LanesPrecision};
use crate::symbols::Symbol;

/// Share of cases in which an interval should hold the true value.
pub const CONFIDENCE: f64 = 0.95;

/// Quantile of the normal distribution that belongs to [`CONFIDENCE`], both sides.
const NORMAL: f64 = 1.959_963_985;

/// What is known of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knowledge {
    /// The parameter.
    pub symbol: Symbol,
    /// Where the interval ends, lower and upper, in the parameter's unit.
    pub interval: [f64; 2],
    /// True where an end is the bound of the search, and not the data's.
    pub open: [bool; 2],
    /// Samples, all signals of one time together, that would tell as much if they were independent.
    pub effective_samples: f64,
    /// Rise of the score at which the interval ends, in units of the score.
    pub rise: f64,
}

/// What is known of all searched parameters.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Identifiability {
    /// One entry per searched parameter; empty if it could not be found out, see `note`.
    pub parameters: Vec<Knowledge>,
    /// Why there are no intervals.
    pub note: Option<&'static str>,
    /// Simulated candidates.
    pub evaluations: u64,
}

/// Finds out how well the parameters of a calibrated candidate are known. The evaluator simulates the candidates of the profiles; the
/// f64 reference does the rest.
///
/// # Errors
/// When the evaluator fails.
pub fn identify(
    evaluator: &mut dyn Evaluator,
    space: &SearchSpace,
    candidate: &[f64],
    seed: u64,
) -> Result<Identifiability, EvaluateError> {
    let none = |note, evaluations| Ok(Identifiability { parameters: Vec::new(), note: Some(note), evaluations });
    let local = match local::Local::new(evaluator.cases(), evaluator.gof(), space, candidate) {
        Ok(local) => local,
        Err(refused) => return none(refused.note, refused.evaluations),
    };
    let mut spreads: Vec<local::Spread> = (0..local.free.len()).map(|k| local.spread(k)).collect();
    let rises = spreads.iter().map(|s| s.rise).filter(|rise| rise.is_finite() && *rise > 0.0);
    let Some(deepest) = rises.reduce(f64::min) else {
        return none("no parameter changes the score", local.evaluations());
    };
    // What changes nothing rises nowhere, whatever is asked of it.
    for spread in spreads.iter_mut().filter(|s| !(s.rise.is_finite() && s.rise > 0.0)) {
        spread.rise = deepest;
    }
    let mut profiles = profile::profiles(evaluator, space, candidate, &local, &spreads, seed)?;
    if !profiles.start.is_finite() {
        // On the edge of what is feasible f32 may find it infeasible.
        let mut exact = Lanes::new(evaluator.cases().to_vec(), *evaluator.gof(), LanesPrecision::F64)?;
        let before = profiles.evaluations;
        profiles = profile::profiles(&mut exact, space, candidate, &local, &spreads, seed)?;
        profiles.evaluations += before;
    }
    let evaluations = local.evaluations() + profiles.evaluations;
    if !profiles.start.is_finite() {
        return none("the candidate lies on the very edge of what is feasible", evaluations);
    }
    // A tenth of the rise: it shifts an interval by less than a tenth of its half.
    if profiles.lowest < profiles.start - 0.1 * deepest {
        return none("the candidate is not at a minimum: a better one lies close by, so search longer", evaluations);
    }
    let parameters = spreads.iter().zip(&profiles.ends).enumerate().map(|(k, (spread, ends))| {
        let i = local.free[k];
        let [lower, upper] = space.bounds[i];
        let at = |side: usize| (lower + ends[side].at * (upper - lower)).clamp(lower, upper);
        Knowledge {
            symbol: space.symbols[i],
            interval: [at(0).min(candidate[i]), at(1).max(candidate[i])],
            open: [ends[0].open, ends[1].open],
            effective_samples: spread.effective_samples,
            rise: spread.rise,
        }
    });
    Ok(Identifiability { parameters: parameters.collect(), note: None, evaluations })
}

/// Quantile of Student's t distribution for [`CONFIDENCE`]: the first terms of the expansion of E. A. Cornish and R. A. Fisher (1938);
/// good to 1 % from 4 degrees of freedom on.
fn student(freedom: f64) -> f64 {
    let (z, nu) = (NORMAL, freedom.max(3.0));
    let (z3, z5, z7) = (z.powi(3), z.powi(5), z.powi(7));
    z + (z3 + z) / (4.0 * nu)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * nu * nu)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * nu.powi(3))
}

#[cfg(test)]
mod tests {
    use super::student;

    #[test]
    fn the_quantiles_are_those_of_the_tables() {
        for (freedom, expected) in [(4.0, 2.776), (5.0, 2.571), (10.0, 2.228), (30.0, 2.042), (1e9, 1.960)] {
            assert!((student(freedom) / expected - 1.0).abs() < 0.01, "{freedom}: {}", student(freedom));
        }
    }
}
