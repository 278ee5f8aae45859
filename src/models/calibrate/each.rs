//! Many calibrations that share only the evaluator.

use super::tasks::{Task, run};
use super::{CalibrateError, Calibration, Replicate, SearchSpace};
use crate::evaluator::Evaluator;
use std::ops::ControlFlow;

/// Calibrates each case of an evaluator separately, in the search space of the same place; concurrent generations are simulated together.
/// Each entry is the result of [`calibrate_replicate`](super::calibrate_replicate) on that case alone, replicate 0: the score of a candidate
/// does not depend on its neighbours. When `stop` asks for it, all end with their results so far.
///
/// # Errors
/// When the evaluator fails. A case without a feasible candidate, or stopped before any, is an error of its own entry.
///
/// # Panics
/// Unless there is one search space per case.
pub fn calibrate_each(
    evaluator: &mut dyn Evaluator,
    spaces: &[SearchSpace],
    settings: &Calibration,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Result<Replicate, CalibrateError>>, CalibrateError> {
    assert_eq!(spaces.len(), evaluator.cases().len(), "one search space per case");
    let task = |(case, space)| Task { space, cases: case..case + 1, number: 0 };
    let tasks: Vec<Task> = spaces.iter().enumerate().map(task).collect();
    let mut go_on = |_| if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let outcomes = run(evaluator, &tasks, settings, &mut go_on)?;
    Ok(outcomes.into_iter().map(|outcome| outcome.map_err(|failed| failed.error)).collect())
}
