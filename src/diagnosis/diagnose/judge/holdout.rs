//! The test of a cause on the hold-out.

use crate::diagnose::likelihood::streams;
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, FittedModel, Transferred};
use crate::extension::Extension;
use crate::optimize::stream;
use rand::RngExt;

/// Bootstraps of the hold-out.
const DRAWS: u64 = 200;

/// Share of block bootstraps of the hold-out in which a candidate beats another, and the change by the cause there \[nats\]. Draws in which
/// it changes almost nothing do not count, because they lack the few blocks in which it acts. `alone` caches the scores of `current` on the
/// whole hold-out.
///
/// # Errors
/// As [`FittedModel::transfer`].
pub fn transfers(
    setting: &Context<'_>,
    candidate: &FittedModel,
    cause: &Extension,
    current: &FittedModel,
    alone: &mut Option<Transferred>,
) -> Result<(f64, f64), DiagnoseError> {
    let before = match alone.take() {
        Some(known) => known,
        None => current.transfer(setting, None)?,
    };
    let mine = candidate.transfer(setting, Some(alone.insert(before)))?;
    let theirs = current.transfer(setting, Some(&mine))?;
    let scores = mine.scores(setting)?.into_iter().flatten().zip(theirs.scores(setting)?.into_iter().flatten());
    let gains: Vec<f64> = scores.map(|(a, b)| a - b).collect();
    let changes = mine.changed_by(setting, cause)?;
    let changed: f64 = changes.iter().sum();
    let vote = |draw: u64| {
        let mut rng = stream(setting.question.seed, streams::HOLDOUT, 0, draw);
        let drawn: Vec<usize> = (0..gains.len()).map(|_| rng.random_range(0..gains.len())).collect();
        let sum = |of: &[f64]| drawn.iter().map(|k| of[*k]).sum::<f64>();
        (sum(&changes) >= POLICY.shown.min(changed)).then(|| sum(&gains) > 0.0)
    };
    let votes: Vec<bool> = (0..DRAWS).filter_map(vote).collect();
    let better = votes.iter().filter(|better| **better).count();
    Ok((if votes.is_empty() { 1.0 } else { better as f64 / votes.len() as f64 }, changed))
}
