//! Many calibrations that have nothing to do with each other but the evaluator.

use super::search::{Group, Search, advance};
use super::settled::settled;
use super::{CalibrateError, Calibration, Replicate, SearchSpace};
use crate::evaluator::Evaluator;
use std::ops::ControlFlow;

/// Calibrates each case of an evaluator by itself, in the search space of the same place; all generations of a time are simulated together.
/// Each entry is what [`calibrate_replicate`](super::calibrate_replicate) finds on that case alone, replicate 0: what a candidate scores
/// does not depend on its neighbours. Once `stop` says so, all end with what they have.
///
/// # Errors
/// When the evaluator fails. A case of which no candidate is feasible, or that was stopped before it had any, is an error of its own entry.
///
/// # Panics
/// Unless there is one search space per case.
pub fn calibrate_each(
    evaluator: &mut dyn Evaluator,
    spaces: &[SearchSpace],
    settings: &Calibration,
    stop: &dyn Fn() -> bool,
) -> Result<Vec<Result<Replicate, CalibrateError>>, CalibrateError> {
    assert_eq!(spaces.len(), evaluator.cases().len(), "one search space per case");
    let halves = if evaluator.overlaps() { 2 } else { 1 };
    let half = spaces.len().div_ceil(halves).max(1);
    let search = |case: usize| Search::new(&spaces[case], case..case + 1, settings, 0);
    let mut groups: Vec<Group> = (0..spaces.len())
        .step_by(half)
        .map(|first| Group::new((first..spaces.len().min(first + half)).map(search).collect()))
        .collect();
    let mut go_on = |_| if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    advance(&mut groups, evaluator, &mut go_on)?;
    let settle = |search: Search| {
        let (cases, space) = (search.cases.clone(), search.space);
        let (replicate, rival) = search.finish()?;
        settled(&evaluator.cases()[cases], evaluator.gof(), space, replicate, rival)
    };
    Ok(groups.into_iter().flat_map(|group| group.searches).map(settle).collect())
}
