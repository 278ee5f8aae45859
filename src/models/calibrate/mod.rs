//! Calibration: evaluator + optimiser + replicates = calibrated parameters.

mod bound_set;
mod exact;
mod homotopy;
mod one_driver;
mod search;
mod settled;
mod space;
mod tasks;

pub use bound_set::BoundSet;
pub use homotopy::{DIFFERENCE, descent};
pub use one_driver::{Apart, apart, apart_until};
pub use search::{PROGRAM, SEARCH_REVISION, merit};
pub use space::{BoundsError, Overrides, SearchSpace, bound_times, checked, read_bounds};

use crate::evaluator::{EvaluateError, Evaluator, Failure, Score};
use crate::text::option::GOF;
use crate::text::spelling::UnknownWord;
use std::fmt;
use std::ops::ControlFlow;
use std::time::Duration;
pub use tasks::Task;
use tasks::{Failed, run};

/// Fewer simulations than this are not a search.
pub const EVALUATIONS_MIN: u64 = 100;
/// More replicates than this are a typing error; all of them advance together.
pub const REPLICATES_MAX: u64 = 100_000;

/// An optimiser by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::EnumString, strum::IntoStaticStr, strum::VariantNames)]
#[strum(const_into_str, serialize_all = "snake_case", parse_err_ty = UnknownWord, parse_err_fn = unknown)]
pub enum OptimizerKind {
    /// Gauss-Newton steps in f64 from many starts, until searches agree; without useful derivatives, L-SHADE and CMA-ES.
    #[default]
    Auto,
    /// The paper's genetic algorithm.
    Ga,
    /// L-SHADE: differential evolution that adapts itself, with a shrinking population.
    Lshade,
    /// CMA-ES with restarts in two regimes.
    Cmaes,
}

impl OptimizerKind {
    /// The name of the algorithm that runs.
    #[must_use]
    pub fn runs(self) -> &'static str {
        match self {
            OptimizerKind::Auto => "gauss-newton",
            one => one.into_str(),
        }
    }
}

fn unknown(found: &str) -> UnknownWord {
    UnknownWord::of::<OptimizerKind>("optimizer", found)
}

/// When a replicate ends; whichever comes first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// Simulated candidates, failed ones included; not exceeded by the search, but the first generation is always scored. An optimiser
    /// that has no room left for another generation, or `auto` for another round, ends below them.
    pub max_evaluations: u64,
    /// Generations without gain.
    pub max_stall: u64,
    /// Wall-clock time; makes the result depend on the machine.
    pub max_time: Option<Duration>,
    /// Score that is good enough, by the f64 reference.
    pub target: Option<f64>,
}

impl Default for Stop {
    fn default() -> Self {
        // Eight rounds of `auto` with ten parameters, which may end after four; 8000 generations are the authors' rule for their
        // algorithm.
        Stop { max_evaluations: 300_000, max_stall: 8000, max_time: None, target: None }
    }
}

/// Settings of a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// The optimiser.
    pub optimizer: OptimizerKind,
    /// The seed; replicate r draws from stream (seed, r).
    pub seed: u64,
    /// Number of replicates.
    pub replicates: u64,
    /// Stopping rules of each replicate.
    pub stop: Stop,
    /// Members of a generation of `ga` and of the first one of `lshade`; `None`: the algorithm's own number. The others choose theirs.
    pub population: Option<usize>,
}

impl Default for Calibration {
    fn default() -> Self {
        Calibration { optimizer: OptimizerKind::Auto, seed: 1, replicates: 1, stop: Stop::default(), population: None }
    }
}

/// Why a replicate ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The evaluations were used, or too few remain for another generation or, with `auto`, for another round.
    Evaluations,
    /// No gain for too many generations.
    Stall,
    /// The optimiser expects no more gain.
    Converged,
    /// The time limit was reached.
    Time,
    /// The target was reached.
    Target,
    /// The caller asked to stop.
    Interrupted,
    /// It has ended, for any reason, without a feasible candidate.
    Infeasible,
    /// Every parameter is fixed: one evaluation suffices.
    NothingToSearch,
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            StopReason::Evaluations => "evaluations spent",
            StopReason::Stall => "no gain any more",
            StopReason::Converged => "converged",
            StopReason::Time => "time spent",
            StopReason::Target => "target reached",
            StopReason::Interrupted => "interrupted",
            StopReason::Infeasible => "no feasible candidate found",
            StopReason::NothingToSearch => "every parameter is fixed",
        })
    }
}

/// Result of one replicate.
#[derive(Debug, Clone, PartialEq)]
pub struct Replicate {
    /// Its number, from 0.
    pub number: u64,
    /// The best candidate, one value per parameter of the search space; of infeasible ones the one that came furthest.
    pub candidate: Vec<f64>,
    /// Its score by the f64 reference; infinite if neither the best candidate nor any near it is feasible there, or none was feasible.
    pub score: f64,
    /// Simulated candidates, failed ones included; also those that the reference checked because the best one fails there.
    pub evaluations: u64,
    /// Why it ended.
    pub stop: StopReason,
    /// (evaluations, best score so far) at every gain; it decreases, and ends with `score`. Approximate scores that
    /// turned out to be lower than the exact ones are not in it.
    pub convergence: Vec<(u64, f64)>,
    /// The best candidates of the search, with their scores: the next one takes the place of the best if the reference rejects it.
    pub near: Vec<(f64, Vec<f64>)>,
}

/// A calibration without a result.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum CalibrateError {
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    #[error("replicate {replicate}: none of {evaluations} candidates is feasible: {tally}")]
    Infeasible { replicate: u64, evaluations: u64, tally: Tally },
    #[error("interrupted before the first generation was scored; nothing was found")]
    Interrupted,
}

/// Why candidates have no score.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Runs that ended early.
    pub failed: u64,
    /// The one of them that came furthest.
    pub longest: Option<Failure>,
    /// Candidates that touched an acceleration bound under `bounds=reject`.
    pub rejected: u64,
    /// Complete runs whose goodness of fit is not a number.
    pub undefined: u64,
}

impl Tally {
    fn add(&mut self, scores: &[Score]) {
        for score in scores {
            match score {
                Score::Failed(failure) => {
                    self.failed += 1;
                    if self.longest.is_none_or(|longest| failure.step > longest.step) {
                        self.longest = Some(*failure);
                    }
                }
                Score::Rejected => self.rejected += 1,
                Score::Value(value) => self.undefined += u64::from(!value.is_finite()),
            }
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(longest) = self.longest {
            let (failed, step, kind) = (self.failed, longest.step, longest.kind.into_str());
            write!(f, "{failed} ended early (the best one at sample {step} with `{kind}`), ")?;
        }
        if self.rejected > 0 {
            write!(f, "{} touched an acceleration bound, which the convention rejects, ", self.rejected)?;
        }
        if self.undefined > 0 {
            let undefined = self.undefined;
            return write!(
                f,
                "{undefined} ran to the end, but the goodness of fit is undefined: is a measured signal zero or constant? \
                 `leadlag inspect` shows it; choose another {GOF} or window"
            );
        }
        f.write_str("so widen the bounds, or check the data with `leadlag inspect`")
    }
}

/// Progress of a running calibration after every generation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// The replicate, from 0.
    pub replicate: u64,
    /// Its evaluations so far.
    pub evaluations: u64,
    /// Its best score so far.
    pub best: Option<f64>,
}

/// Calibrates: one entry per replicate, in order. `progress` is called for each replicate after each of its generations; once it
/// breaks, all of them end. The replicates advance together, so that an evaluator gets their generations in one go; each draws from
/// its own stream, so that the result does not depend on it. A replicate without a feasible candidate has an infinite score, and
/// [`StopReason::Infeasible`]; one that was interrupted before its first candidate has no entry.
///
/// # Errors
/// When the evaluator fails, or no replicate finds a feasible candidate.
pub fn calibrate(
    evaluator: &mut dyn Evaluator,
    space: &SearchSpace,
    settings: &Calibration,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Vec<Replicate>, CalibrateError> {
    let cases = 0..evaluator.cases().len();
    let task = |number| Task { space, cases: cases.clone(), number };
    let tasks: Vec<Task> = (0..settings.replicates).map(task).collect();
    let (mut replicates, mut found, mut infeasible) = (Vec::new(), false, None);
    for outcome in run(evaluator, &tasks, settings, &mut |_, told| progress(told))? {
        match outcome {
            Ok(replicate) => {
                found = true;
                replicates.push(replicate);
            }
            // Results so far of an interrupted calibration.
            Err(Failed { error: CalibrateError::Interrupted, .. }) => {}
            Err(Failed { error: error @ CalibrateError::Infeasible { .. }, furthest }) => {
                replicates.extend(furthest.map(|furthest| *furthest));
                infeasible.get_or_insert(error);
            }
            Err(Failed { error, .. }) => return Err(error),
        }
    }
    if found { Ok(replicates) } else { Err(infeasible.unwrap_or(CalibrateError::Interrupted)) }
}

/// Calibrations that share only the evaluator; concurrent generations are simulated together. Each entry is the replicate of that number in
/// [`calibrate`] on the cases of the task alone: the score of a candidate does not depend on its neighbours. `progress` also receives the
/// number of the task, from 0; once it breaks, all of them end with their results so far.
///
/// # Errors
/// When the evaluator fails. A task without a feasible candidate, or stopped before any, is an error of its own entry.
pub fn calibrate_each(
    evaluator: &mut dyn Evaluator,
    tasks: &[Task<'_>],
    settings: &Calibration,
    progress: &mut (dyn FnMut(usize, Progress) -> ControlFlow<()> + Send),
) -> Result<Vec<Result<Replicate, CalibrateError>>, CalibrateError> {
    let outcomes = run(evaluator, tasks, settings, progress)?;
    Ok(outcomes.into_iter().map(|outcome| outcome.map_err(|failed| failed.error)).collect())
}

/// The replicate with the lowest score.
#[must_use]
pub fn best(replicates: &[Replicate]) -> Option<&Replicate> {
    replicates.iter().min_by(|a, b| a.score.total_cmp(&b.score))
}

/// Coefficient of variation of those scores that are finite: sample standard deviation over mean; `None` with fewer than two.
#[must_use]
pub fn coefficient_of_variation(scores: impl IntoIterator<Item = f64>) -> Option<f64> {
    let scores: Vec<f64> = scores.into_iter().filter(|score| score.is_finite()).collect();
    let count = scores.len() as f64;
    if scores.len() < 2 {
        return None;
    }
    let mean = scores.iter().sum::<f64>() / count;
    let variance = scores.iter().map(|score| (score - mean).powi(2)).sum::<f64>() / (count - 1.0);
    Some(variance.sqrt() / mean.abs())
}
