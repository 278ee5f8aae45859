//! What an extension gains for the user: free-simulation NRMSE(s,v,a) on data that took no part, base and extended alike
//! recalibrated on the same training data.

use super::drive::Drive;
use super::free::{Free, free};
use super::wide;
use crate::calibrate::{BoundsError, CalibrateError, Calibration, Progress, SearchSpace, Stop, best, calibrate};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::{Case, CaseError, EvaluateError};
use crate::lanes::{Lanes, LanesPrecision};
use crate::optimize::stream;
use crate::score::GoodnessOfFit;
use crate::symbols::Parameters;
use rand::RngExt;
use std::ops::ControlFlow;

/// Blocks of the bootstrap \[s\]: longer than what an error at one moment does to the next ones.
const BLOCK_S: f64 = 30.0;
/// Draws of the bootstrap.
const DRAWS: usize = 2000;
/// Stream of the bootstrap's random numbers: none that an optimiser draws from.
const STREAM: u64 = 0x6761_696e;

/// The gain on the hold-out.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Gain {
    /// NRMSE(s,v,a) of the base model; none if it crashes on a hold-out drive.
    pub base: Option<f64>,
    /// Of the extended model.
    pub extended: Option<f64>,
    /// 95 % interval of base minus extended.
    pub interval: Option<[f64; 2]>,
    /// NRMSE of s, v, a by themselves: base, then extended.
    pub signals: Option<[[f64; 3]; 2]>,
    /// Runs of base and extended, on training and hold-out drives, that crash or break off; of so many drives.
    pub broken_off: [usize; 2],
    /// Drives that were simulated.
    pub drives: usize,
    /// Parameters of both models as recalibrated, by name.
    pub parameters: [std::collections::BTreeMap<String, f64>; 2],
    /// In one sentence.
    pub sentence: String,
}

/// A gain that cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum GainError {
    /// A case of the variant.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// Its bounds.
    #[error(transparent)]
    Bounds(#[from] BoundsError),
    /// Its calibration.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// Its simulation.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
}

/// How a gain is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// The one seed.
    pub seed: u64,
    /// Simulations per calibration, at most.
    pub max_evaluations: u64,
}

/// Calibrates a variant on drives, within the wide bounds.
///
/// # Errors
/// When it cannot be simulated, or no candidate is feasible.
pub fn recalibrated(
    drives: &[Drive],
    variant: Variant,
    effort: &Effort,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Parameters, GainError> {
    let cases = cases(drives, variant)?;
    let vehicle = drives.first().and_then(|drive| drive.vehicle.as_deref());
    let space = SearchSpace::new(&variant, vehicle, Convention::PAPER, &wide::overrides(&variant))?;
    let mut evaluator = Lanes::new(cases, GoodnessOfFit::NRMSE_SVA, LanesPrecision::Plain)?;
    let stop = Stop { max_evaluations: effort.max_evaluations, ..Stop::default() };
    let settings = Calibration { seed: effort.seed, stop, ..Calibration::default() };
    let replicates = calibrate(&mut evaluator, &space, &settings, progress)?;
    let winner = best(&replicates).ok_or(CalibrateError::Interrupted)?;
    Ok(space.parameters(&winner.candidate))
}

fn cases(drives: &[Drive], variant: Variant) -> Result<Vec<Case>, CaseError> {
    drives.iter().map(|drive| drive.case(variant)).collect()
}

/// Measures the gain.
///
/// # Errors
/// [`GainError`].
pub fn gain(
    train: &[Drive],
    holdout: &[Drive],
    [base, extended]: [Variant; 2],
    effort: &Effort,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Gain, GainError> {
    let models = [
        (base, recalibrated(train, base, effort, progress)?),
        (extended, recalibrated(train, extended, effort, progress)?),
    ];
    let mut runs: Vec<Vec<Free>> = Vec::new();
    let mut broken_off = [0; 2];
    for (k, (variant, parameters)) in models.iter().enumerate() {
        let on_holdout = free(&cases(holdout, *variant)?, parameters)?;
        let on_train = free(&cases(train, *variant)?, parameters)?;
        broken_off[k] = on_holdout.iter().chain(&on_train).filter(|run| !run.complete).count();
        runs.push(on_holdout);
    }
    let parameters = models.map(|(variant, parameters)| {
        let named = |symbol: crate::symbols::Symbol| (symbol.name().to_owned(), parameters.get(symbol));
        variant.parameters().into_iter().map(named).collect()
    });
    let complete = |runs: &[Free]| runs.iter().all(|run| run.complete);
    let squares = [&runs[0], &runs[1]].map(|runs| complete(runs).then(|| squares(holdout, runs)));
    let drives = train.len() + holdout.len();
    let mut found = Gain {
        base: squares[0].as_deref().map(nrmse_sva),
        extended: squares[1].as_deref().map(nrmse_sva),
        interval: None,
        signals: None,
        broken_off,
        drives,
        parameters,
        sentence: String::new(),
    };
    if let [Some(base), Some(extended)] = &squares {
        found.interval = Some(interval(base, extended, effort.seed));
        found.signals = Some([nrmse(&all(base)), nrmse(&all(extended))]);
    }
    found.sentence = found.words();
    Ok(found)
}

impl Gain {
    /// Base minus extended.
    #[must_use]
    pub fn difference(&self) -> Option<f64> {
        Some(self.base? - self.extended?)
    }

    /// True if the interval lies above zero.
    #[must_use]
    pub fn is_gain(&self) -> bool {
        self.interval.is_some_and(|[low, _]| low > 0.0)
    }

    fn words(&self) -> String {
        let (Some(base), Some(extended), Some([low, high])) = (self.base, self.extended, self.interval) else {
            let which = if self.base.is_none() { "base" } else { "extended" };
            return format!("the {which} model does not get to the end of the drive that was held back");
        };
        let what = match (low > 0.0, high < 0.0) {
            (true, _) => "a gain",
            (_, true) => "a loss",
            _ => "no gain: the interval contains zero",
        };
        format!(
            "NRMSE(s,v,a) {base:.4} with the base model, {extended:.4} with the extended one, on data used for nothing else; \
             difference {:+.4} [{low:+.4}, {high:+.4}]: {what}",
            base - extended
        )
    }
}

/// Sums of a block of samples: squared errors and squared measured values of s, v, a.
type Block = [[f64; 3]; 2];

fn squares(drives: &[Drive], runs: &[Free]) -> Vec<Block> {
    let mut blocks = Vec::new();
    for (drive, run) in drives.iter().zip(runs) {
        let width = ((BLOCK_S / drive.dt()).round() as usize).max(1);
        let count = run.errors[0].len();
        for start in (0..count).step_by(width) {
            let mut block = [[0.0; 3]; 2];
            for i in start..(start + width).min(count) {
                for k in 0..3 {
                    let error = run.errors[k][i];
                    block[0][k] += error * error;
                    block[1][k] += (run.simulated[k][i] - error).powi(2);
                }
            }
            blocks.push(block);
        }
    }
    blocks
}

fn all(blocks: &[Block]) -> Block {
    let mut sum = [[0.0; 3]; 2];
    for block in blocks {
        (0..2).for_each(|i| (0..3).for_each(|k| sum[i][k] += block[i][k]));
    }
    sum
}

fn nrmse(sum: &Block) -> [f64; 3] {
    [0, 1, 2].map(|k| (sum[0][k] / sum[1][k].max(1e-300)).sqrt())
}

fn nrmse_sva(blocks: &[Block]) -> f64 {
    nrmse(&all(blocks)).iter().sum()
}

/// 95 % interval of the difference, both models drawn with the same blocks.
fn interval(base: &[Block], extended: &[Block], seed: u64) -> [f64; 2] {
    let mut random = stream(seed, STREAM, 0, 0);
    let mut differences: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let (mut a, mut b) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
            for _ in 0..base.len() {
                let pick = random.random_range(0..base.len());
                for i in 0..2 {
                    for k in 0..3 {
                        a[i][k] += base[pick][i][k];
                        b[i][k] += extended[pick][i][k];
                    }
                }
            }
            nrmse(&a).iter().sum::<f64>() - nrmse(&b).iter().sum::<f64>()
        })
        .collect();
    differences.sort_by(f64::total_cmp);
    [differences[DRAWS / 40], differences[DRAWS - 1 - DRAWS / 40]]
}
