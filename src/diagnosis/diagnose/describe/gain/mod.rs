//! The gain of an extension for the user: NRMSE(s,v,a) of free simulations on data that neither model is calibrated on. Base and extended
//! model are recalibrated on the same training data.

use super::event_mask::{EventMask, absent};
use super::free::{Free, GainError, free};
use crate::calibrate::{CalibrateError, Calibration, Overrides, Progress, SearchSpace, Stop, best, calibrate};
use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::robust::block_length;
use crate::diagnose::likelihood::streams;
use crate::diagnose::outcome::{Adopted, Fitted};
use crate::diagnose::question::{Effort, Question};
use crate::evaluator::{Case, Evaluator, Population, Score};
use crate::lanes::{Lanes, LanesPrecision};
use crate::optimize::stream;
use crate::score::GoodnessOfFit;
use crate::symbols::{Parameters, Symbol};
use rand::RngExt;
use std::ops::ControlFlow;

/// Number of bootstrap draws.
const DRAWS: usize = 2000;

/// The gain on the hold-out.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Gain {
    /// NRMSE(s,v,a) of the base model; `None` if it crashes on a hold-out drive.
    pub base: Option<f64>,
    /// NRMSE(s,v,a) of the extended model.
    pub extended: Option<f64>,
    /// 95 % interval of base minus extended.
    pub interval: Option<[f64; 2]>,
    /// NRMSE of s, v and a separately: base, then extended.
    pub signals: Option<[[f64; 3]; 2]>,
    /// Number of runs of base and extended, on training and hold-out drives, that crash or end early.
    pub broken_off: [usize; 2],
    /// Drives that were simulated.
    pub drives: usize,
    /// For the hold-out drives alone: number of runs of base and extended that crash or end early, and number of drives.
    #[serde(default)]
    pub broken_off_held_back: [usize; 3],
    /// Recalibrated parameters of both models, by name.
    pub parameters: [std::collections::BTreeMap<String, f64>; 2],
    /// In one sentence.
    pub sentence: String,
}

/// How a gain is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainSettings {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Simulations per calibration, at most.
    pub max_evaluations: u64,
}

impl GainSettings {
    /// The settings of an effort.
    #[must_use]
    pub fn of(effort: Effort, seed: u64) -> GainSettings {
        let max_evaluations = match effort {
            Effort::Quick => 4_000,
            Effort::Normal => 20_000,
            Effort::Thorough => 100_000,
        };
        GainSettings { seed, max_evaluations }
    }
}

/// The evaluator of candidates on drives. It is f64 if an event does not happen in all of them, or if clocks are too far from 0 for single
/// precision, such as those that count from 1970.
fn evaluator(cases: Vec<Case>, train: &[Drive], adopted: &[Adopted]) -> Result<Box<dyn Evaluator>, GainError> {
    let absent: Vec<_> = train.iter().map(|drive| absent(adopted, drive)).collect();
    let everywhere = absent.iter().all(Vec::is_empty);
    let plain = everywhere && cases.iter().all(|case| case.check_clock().is_ok());
    let precision = if plain { LanesPrecision::Plain } else { LanesPrecision::F64 };
    let lanes = Lanes::new(cases, GoodnessOfFit::NRMSE_SVA, precision)?;
    Ok(if everywhere { Box::new(lanes) } else { Box::new(EventMask::new(lanes, absent)) })
}

/// Calibrates a model on drives, within the bounds of the diagnosis; the times of its events stay fixed. The score counts the samples that
/// `beside` scores, too.
fn recalibrated(
    train: &[Drive],
    [model, beside]: [&Fitted; 2],
    adopted: &[Adopted],
    overrides: &Overrides,
    settings: &GainSettings,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Parameters, GainError> {
    let axes = Model::new(model.variant, train, overrides, &[])?;
    let bounds = axes.symbols.iter().zip(&axes.axes).map(|(symbol, axis)| {
        let now = model.parameters.get(*symbol);
        if symbol.is_time() { [now, now] } else { [axis.lower, axis.upper] }
    });
    let space = SearchSpace { bounds: bounds.collect(), symbols: axes.symbols.clone() };
    let case = |drive: &Drive| drive.case_beside(model.variant, beside.variant, overrides);
    let cases = train.iter().map(case).collect::<Result<_, _>>()?;
    let mut evaluator = evaluator(cases, train, adopted)?;
    let stop = Stop { max_evaluations: settings.max_evaluations, ..Stop::default() };
    let calibration = Calibration { seed: settings.seed, stop, ..Calibration::default() };
    let replicates = calibrate(evaluator.as_mut(), &space, &calibration, progress)?;
    let winner = best(&replicates).ok_or(CalibrateError::Interrupted)?;
    // The diagnosis has been near the minimum already, and a short search may end above it.
    let mut both = Population::new(&space.symbols);
    both.push(&winner.candidate);
    let within = |(symbol, [lower, upper]): (&Symbol, &[f64; 2])| model.parameters.get(*symbol).clamp(*lower, *upper);
    both.push(&space.symbols.iter().zip(&space.bounds).map(within).collect::<Vec<f64>>());
    let mut scores = [Score::Rejected; 2];
    evaluator.evaluate(&both, &mut scores)?;
    let better = match scores {
        [Score::Value(found), Score::Value(estimated)] => estimated < found,
        [_, estimated] => matches!(estimated, Score::Value(_)),
    };
    Ok(space.parameters(both.values(usize::from(better))))
}

/// NRMSE(s,v,a) of free simulations of drives, together; `None` if one of them ends early.
#[must_use]
pub fn nrmse_of(drives: &[Drive], runs: &[Free]) -> Option<f64> {
    let complete = !runs.is_empty() && runs.iter().all(|run| run.complete);
    complete.then(|| nrmse(&all(&squares(drives, runs))).iter().sum())
}

/// Measures the gain of an extended model over the base, on the drives and within the bounds of a question.
///
/// # Errors
/// [`GainError`].
pub fn gain(
    question: &Question<'_>,
    [base, extended]: [&Fitted; 2],
    adopted: &[Adopted],
    settings: &GainSettings,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Gain, GainError> {
    let (train, holdout) = (question.train, question.holdout);
    let models = [
        (base.variant, recalibrated(train, [base, extended], &[], question.bounds, settings, progress)?),
        (extended.variant, recalibrated(train, [extended, base], adopted, question.bounds, settings, progress)?),
    ];
    let mut runs: Vec<Vec<Free>> = Vec::new();
    let (mut broken_off, mut held_back) = ([0; 2], [0, 0, holdout.len()]);
    let broken = |runs: &[Free]| runs.iter().filter(|run| !run.complete).count();
    for (k, (variant, parameters)) in models.iter().enumerate() {
        let compared = [*variant, models[1 - k].0];
        let on_holdout = free(holdout, compared, parameters, adopted, question.bounds)?;
        held_back[k] = broken(&on_holdout);
        broken_off[k] = held_back[k] + broken(&free(train, compared, parameters, adopted, question.bounds)?);
        runs.push(on_holdout);
    }
    let parameters = models.map(|(variant, parameters)| {
        let named = |symbol: Symbol| (symbol.name().to_owned(), parameters.get(symbol));
        variant.parameters().into_iter().map(named).collect()
    });
    let [base, extended] = [0, 1].map(|k| nrmse_of(holdout, &runs[k]));
    let mut found = Gain {
        base,
        extended,
        interval: None,
        signals: None,
        broken_off,
        drives: train.len() + holdout.len(),
        broken_off_held_back: held_back,
        parameters,
        sentence: String::new(),
    };
    if base.is_some() && extended.is_some() {
        // Both runs are complete and start together, so their blocks hold the same samples.
        debug_assert!(runs[0].iter().zip(&runs[1]).all(|(base, extended)| base.first == extended.first));
        let [base, extended] = [0, 1].map(|k| squares(holdout, &runs[k]));
        found.signals = Some([nrmse(&all(&base)), nrmse(&all(&extended))]);
        let pairs: Vec<[Block; 2]> = base.into_iter().zip(extended).map(|(base, extended)| [base, extended]).collect();
        found.interval = Some(interval(&pairs, settings.seed));
    }
    found.sentence = found.words();
    Ok(found)
}

impl Gain {
    /// Number of runs of base and extended that crash or end early, and number of drives: on the hold-out, then on the training drives.
    #[must_use]
    pub fn crashes(&self) -> [[usize; 3]; 2] {
        let [base, extended, drives] = self.broken_off_held_back;
        [self.broken_off_held_back, [self.broken_off[0] - base, self.broken_off[1] - extended, self.drives - drives]]
    }

    fn words(&self) -> String {
        let (Some(base), Some(extended), Some([low, high])) = (self.base, self.extended, self.interval) else {
            let which = match (self.base, self.extended) {
                (None, None) => "neither model reaches",
                (None, _) => "the base model does not reach",
                _ => "the extended model does not reach",
            };
            return format!("{which} the end of the held-back data, so their errors cannot be compared");
        };
        let what = match (low > 0.0, high < 0.0) {
            (true, _) => "a gain",
            (_, true) => "a loss",
            _ => "no gain: the interval contains zero",
        };
        format!(
            "NRMSE(s,v,a) {base:.4} with the base model, {extended:.4} with the extended one, on data that neither was calibrated on \
             (but that helped to decide whether the cause carries over); difference {:+.4} [{low:+.4}, {high:+.4}]: {what}",
            base - extended
        )
    }
}

/// Sums of a block of samples: squared errors and squared measured values of s, v, a.
type Block = [[f64; 3]; 2];

fn squares(drives: &[Drive], runs: &[Free]) -> Vec<Block> {
    let mut blocks = Vec::new();
    for (drive, run) in drives.iter().zip(runs) {
        let width = block_length(drive.dt());
        let count = run.errors[0].len();
        for start in (0..count).step_by(width) {
            let mut block = [[0.0; 3]; 2];
            for i in start..(start + width).min(count) {
                for (k, (errors, simulated)) in run.errors.iter().zip(&run.simulated).enumerate() {
                    block[0][k] += errors[i].powi(2);
                    block[1][k] += (simulated[i] - errors[i]).powi(2);
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

/// 95 % interval of the difference between base and extended model, from the same blocks of both.
fn interval(pairs: &[[Block; 2]], seed: u64) -> [f64; 2] {
    let mut random = stream(seed, streams::GAIN, 0, 0);
    let mut differences: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let (mut a, mut b) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
            for _ in 0..pairs.len() {
                let [base, extended] = &pairs[random.random_range(0..pairs.len())];
                for i in 0..2 {
                    for k in 0..3 {
                        a[i][k] += base[i][k];
                        b[i][k] += extended[i][k];
                    }
                }
            }
            nrmse(&a).iter().sum::<f64>() - nrmse(&b).iter().sum::<f64>()
        })
        .collect();
    differences.sort_by(f64::total_cmp);
    [differences[DRAWS / 40], differences[DRAWS - 1 - DRAWS / 40]]
}

#[cfg(test)]
mod tests;
