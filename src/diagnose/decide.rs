//! When a cause counts as found.

use super::candidate::{Candidate, Held, Setting};
use super::model::is_time;
use super::observer::Noise;
use super::verdict::DiagnoseError;
use crate::extension::Extension;
use crate::optimize::stream;
use rand::RngExt;

/// Probability of a false name in data without a cause, for which the threshold is made.
const ALPHA: f64 = 0.01;
/// While the missing acceleration is larger than this \[m/s²\] and shorter than this \[s\] thresholds are raised: strong gusts feed
/// back through the law and make false lags.
const GUSTS: (f64, f64) = (0.1, 3.0);
/// By this factor.
const GUSTS_FACTOR: f64 = 2.5;
/// Gain that a cause local by nature needs instead of both folds and many blocks \[nats\].
const LOCAL: f64 = 60.0;
/// Missing acceleration that a complete model leaves without gusts, at most \[m/s²\].
const CALM: f64 = 0.02;
/// See [`margin`].
const CLOSE: f64 = 6.0;
/// Resolution of a searched time \[s\], for the charge of having searched it.
const RESOLUTION_S: f64 = 5.0;
/// Share of bootstraps in which a cause has to gain on the hold-out.
const TRANSFERS: f64 = 0.9;
/// Causes whose negative size is a proxy for something else: nothing pushes a car.
const ONE_SIDED: [&str; 3] = ["aero_drag", "const_decel", "leader_accel_ff"];
/// Identifiability below which a cause is absorbed by the calibration.
pub const ABSORBED: f64 = 0.02;

/// What a cause has to gain \[nats\]: 2 ln(K / alpha) for K causes, inflated by the correlation of the innovations.
#[must_use]
pub fn need(causes: usize, inflation: f64, noise: &Noise) -> f64 {
    let analytic = 2.0 * (causes.max(1) as f64 / ALPHA).ln() * inflation;
    let gusty = noise.sigma_d > GUSTS.0 && noise.tau_d < GUSTS.1;
    if gusty { GUSTS_FACTOR * analytic } else { analytic }
}

/// Difference of evidence below which two causes are not told apart \[nats\]: odds of several hundred, inflated. Where gusts remain
/// the observer's states are not what the car saw, which favours one member of a family over another by more.
#[must_use]
pub fn margin(inflation: f64, noise: Noise, need: f64) -> f64 {
    if noise.sigma_d > CALM { need } else { CLOSE * inflation }
}

/// How well a cause explains what a model lacks.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Gain on all training data \[nats\].
    pub gain: f64,
    /// Gain held out, sum of both folds, less the charge for searched times \[nats\].
    pub held: f64,
    /// The same per fold, without the charge.
    pub folds: [f64; 2],
    /// Without the two best blocks.
    pub trimmed: f64,
    /// True for a cause that acts in one stretch only.
    pub local: bool,
}

impl Evidence {
    /// Of a candidate over another one that lacks the cause.
    #[must_use]
    pub fn of(
        setting: &Setting<'_>,
        candidate: &Candidate,
        cause: &Extension,
        held: &Held,
        current: &Candidate,
        current_held: &Held,
    ) -> Evidence {
        let (folds, mut blocks) = held.gain(current_held);
        let times = cause.parameters.iter().filter(|symbol| is_time(**symbol)).count();
        let span: f64 = setting.question.train.iter().map(|d| d.samples() as f64 * d.dt()).sum();
        let charge = times as f64 * (span / RESOLUTION_S).max(1.0).ln();
        blocks.sort_by(|a, b| b.total_cmp(a));
        let trimmed = blocks.iter().skip(2).sum();
        let gain = candidate.fit.log_likelihood - current.fit.log_likelihood;
        Evidence { gain, held: folds[0] + folds[1] - charge, folds, trimmed, local: times > 1 }
    }

    /// What counts when evidence is compared: where the base fails on the other fold the held-out gain explodes, so not more than
    /// the gain on all data.
    #[must_use]
    pub fn counts(&self) -> f64 {
        self.held.min(self.gain)
    }

    /// Why it does not pass; `None` if it does.
    #[must_use]
    pub fn objection(&self, need: f64) -> Option<String> {
        let counts = self.counts();
        if counts <= need {
            return Some(format!("{counts:.1} nats, {need:.1} needed"));
        }
        if self.local {
            return (counts <= LOCAL).then(|| format!("{counts:.1} nats, {LOCAL:.0} needed of an event"));
        }
        if self.folds.iter().any(|fold| *fold <= 0.0) {
            return Some("one fold speaks against it".to_owned());
        }
        (self.trimmed <= need / 2.0).then(|| format!("without the two best blocks only {:.1} nats", self.trimmed))
    }
}

/// Why an estimate is a proxy and not a name; `None` if it can be one.
#[must_use]
pub fn proxy(candidate: &Candidate, cause: &Extension) -> Option<String> {
    for k in candidate.model.positions(cause) {
        let (symbol, axis, value) =
            (candidate.model.symbols[k], candidate.model.axes[k], candidate.fit.point.values[k]);
        let Some(neutral) = symbol.neutral() else { continue };
        if ONE_SIDED.contains(&cause.name.as_str()) && value < 0.0 {
            return Some(format!("{} = {value:.3} {} has the wrong sign", symbol.name(), symbol.unit()));
        }
        let idle = (axis.coordinate(value) - axis.coordinate(neutral)).abs() < 1e-3;
        if axis.at_bound(value) && !idle {
            return Some(format!("{} = {value:.3} {} lies on its bound", symbol.name(), symbol.unit()));
        }
    }
    None
}

/// Share of block bootstraps of the hold-out in which a candidate beats another; 1 without a hold-out.
///
/// # Errors
/// As [`Candidate::transfer`].
pub fn transfers(setting: &Setting<'_>, candidate: &Candidate, current: &Candidate) -> Result<f64, DiagnoseError> {
    const DRAWS: u64 = 200;
    if setting.question.holdout.is_empty() {
        return Ok(1.0);
    }
    let (mine, theirs) = (candidate.transfer(setting)?, current.transfer(setting)?);
    let gains: Vec<f64> = mine.iter().flatten().zip(theirs.iter().flatten()).map(|(a, b)| a - b).collect();
    let better = |draw: &u64| {
        let mut rng = stream(setting.question.seed, u64::MAX - 1, 0, *draw);
        let sum: f64 = (0..gains.len()).map(|_| gains[rng.random_range(0..gains.len())]).sum();
        sum > 0.0
    };
    Ok((0..DRAWS).filter(better).count() as f64 / DRAWS as f64)
}

/// The objection of the hold-out, if any; events need not recur there.
///
/// # Errors
/// As [`transfers`].
pub fn gate(
    setting: &Setting<'_>,
    candidate: &Candidate,
    cause: &Extension,
    current: &Candidate,
) -> Result<Option<String>, DiagnoseError> {
    if cause.parameters.iter().any(|symbol| is_time(*symbol)) {
        return Ok(None);
    }
    let share = transfers(setting, candidate, current)?;
    Ok((share < TRANSFERS)
        .then(|| format!("it gains on the hold-out in {:.0} % of the bootstraps only", 100.0 * share)))
}
