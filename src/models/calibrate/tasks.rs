//! Calibrations that share an evaluator.

use super::homotopy::{self, Ended, Ground};
use super::search::{Group, Search, advance};
use super::settled::settled;
use super::{CalibrateError, Calibration, Progress, Replicate, SearchSpace, StopReason};
use crate::evaluator::Evaluator;
use crate::lanes::{Lanes, LanesPrecision};
use rayon::prelude::*;
use std::ops::{ControlFlow, Range};
use std::sync::Mutex;

/// One calibration.
pub struct Task<'a> {
    /// Its parameters and their bounds.
    pub space: &'a SearchSpace,
    /// The cases of the evaluator that candidates are simulated on.
    pub cases: Range<usize>,
    /// The replicate, which draws from its own stream.
    pub number: u64,
}

/// A calibration without a result.
pub(super) struct Failed {
    pub error: CalibrateError,
    /// Of infeasible candidates, the one that came furthest.
    pub furthest: Option<Box<Replicate>>,
}

/// Runs tasks in parallel: by derivatives where they are useful, otherwise by scores alone. One entry per task, in order; none depends on
/// its neighbours. `progress` also receives the number of the task, from 0.
pub(super) fn run(
    evaluator: &mut dyn Evaluator,
    tasks: &[Task<'_>],
    settings: &Calibration,
    progress: &mut (dyn FnMut(usize, Progress) -> ControlFlow<()> + Send),
) -> Result<Vec<Result<Replicate, Failed>>, CalibrateError> {
    // Once the caller has stopped, all tasks end.
    let told = Mutex::new((progress, false));
    let tell = |task: usize, progress: Progress| {
        let mut told = told.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        told.1 |= (told.0)(task, progress).is_break();
        if told.1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let ground = Ground::new(evaluator.cases(), evaluator.gof(), settings)?;
    let searched: Vec<usize> = (0..tasks.len()).filter(|i| !tasks[*i].space.free().is_empty()).collect();
    let groups: Vec<&[usize]> = match &ground {
        Some(_) => searched.chunk_by(|a, b| tasks[*a].cases == tasks[*b].cases).flat_map(shared).collect(),
        None => Vec::new(),
    };
    let begin = |group: &&[usize]| {
        let own: Vec<&Task> = group.iter().map(|&i| &tasks[i]).collect();
        let ground = ground.as_ref().expect("there are groups");
        homotopy::search(ground, &own, settings, &|k, told| tell(group[k], told))
    };
    // A single group would run outside the pool, and enter it for every stretch of samples.
    let ended: Vec<Vec<Ended>> = rayon::scope(|_| groups.par_iter().map(begin).collect::<Result<_, _>>())?;
    let mut begun: Vec<Option<Ended>> = tasks.iter().map(|_| None).collect();
    for (i, ended) in groups.iter().flat_map(|group| *group).zip(ended.into_iter().flatten()) {
        begun[*i] = Some(ended);
    }
    let is_open = |i: &usize| !matches!(begun[*i], Some(Ended::Found(_)));
    let mut going: Vec<usize> = (0..tasks.len()).filter(is_open).collect();
    // After a caller has stopped the searches, no others run.
    if told.lock().unwrap_or_else(std::sync::PoisonError::into_inner).1 {
        going.clear();
    }
    // After a search by derivatives the result must not depend on the evaluator.
    let mut exact = match &ground {
        Some(_) if !going.is_empty() => {
            Some(Lanes::new(evaluator.cases().to_vec(), *evaluator.gof(), LanesPrecision::F64)?)
        }
        _ => None,
    };
    let evaluator = exact.as_mut().map_or(evaluator, |exact| exact as &mut dyn Evaluator);
    let search = |i: &usize| {
        let (task, mut settings) = (&tasks[*i], *settings);
        let earlier = match &begun[*i] {
            Some(Ended::Open(earlier)) => earlier.evaluations,
            _ => 0,
        };
        settings.stop.max_evaluations = settings.stop.max_evaluations.saturating_sub(earlier).max(1);
        let mut search = Search::new(task.space, task.cases.clone(), &settings, task.number);
        (search.task, search.earlier) = (*i, earlier);
        search
    };
    let together = if evaluator.overlaps() { going.len().div_ceil(2).max(1) } else { at_a_time(evaluator, tasks) };
    let mut groups: Vec<Group> =
        going.chunks(together).map(|some| Group::new(some.iter().map(search).collect())).collect();
    advance(&mut groups, evaluator, &mut |task, told| tell(task, told))?;
    let mut searches: Vec<Option<Search>> = tasks.iter().map(|_| None).collect();
    for (i, search) in going.into_iter().zip(groups.into_iter().flat_map(|group| group.searches)) {
        searches[i] = Some(search);
    }
    let (cases, gof) = (evaluator.cases(), evaluator.gof());
    let end = |((task, begun), search): ((&Task, Option<Ended>), Option<Search>)| {
        let settled = |replicate, rival| {
            settled(&cases[task.cases.clone()], gof, task.space, replicate, rival)
                .map_err(|error| Failed { error, furthest: None })
        };
        let Some(search) = search else {
            return match begun {
                Some(Ended::Found(replicate)) => settled(replicate, None),
                Some(Ended::Open(replicate)) if replicate.score.is_finite() => settled(replicate, None),
                _ => Err(Failed { error: CalibrateError::Interrupted, furthest: None }),
            };
        };
        let furthest = search.furthest();
        let later = search.finish();
        match (begun, later) {
            (Some(Ended::Open(earlier)), later) if earlier.score.is_finite() => match later {
                Ok((later, rival)) => {
                    let earlier = settled(earlier, None)?;
                    Ok(better(earlier, settled(later, rival)?))
                }
                Err(_) => settled(earlier, None),
            },
            (_, Ok((later, rival))) => settled(later, rival),
            (_, Err(error)) => Err(Failed { error, furthest: furthest.map(Box::new) }),
        }
    };
    // The reference takes some milliseconds for each, which adds up over a thousand replicates.
    Ok(tasks.par_iter().zip(begun).zip(searches).map(end).collect())
}

/// Searches at most that share blocks: more do not fill them better.
const SIDE_BY_SIDE: usize = 10;

/// Tasks on the same cases in groups that share blocks, but at least as many groups as threads.
fn shared(tasks: &[usize]) -> std::slice::Chunks<'_, usize> {
    tasks.chunks(tasks.len().div_ceil(rayon::current_num_threads()).clamp(1, SIDE_BY_SIDE))
}

/// Candidate-steps between two looks at the caller, per thread: 0.2 s of `lanes` on a slow core, and more than enough for all lanes of a block.
const STEPS_AT_A_TIME: usize = 10_000_000;
/// Candidates of a generation, for the size of its work.
const GENERATION: usize = 100;

/// Number of searches that simulate a generation together on the CPU, so that a caller who stops thousands of them need not wait for all.
fn at_a_time(evaluator: &dyn Evaluator, tasks: &[Task<'_>]) -> usize {
    let samples = |task: &Task| evaluator.cases()[task.cases.clone()].iter().map(|case| case.s.len()).sum::<usize>();
    let steps = GENERATION * tasks.iter().map(samples).max().unwrap_or(1).max(1);
    (STEPS_AT_A_TIME * rayon::current_num_threads() / steps).max(1)
}

/// The better one of two searches of one task, with the cost of both. They have converged only if the later one also found the lowest.
fn better(earlier: Replicate, later: Replicate) -> Replicate {
    let evaluations = earlier.evaluations + later.evaluations;
    let mut convergence = earlier.convergence;
    for (spent, score) in &later.convergence {
        if convergence.last().is_none_or(|(_, last)| score < last) {
            convergence.push((earlier.evaluations + spent, *score));
        }
    }
    let near = earlier.near.into_iter().chain(later.near).collect();
    let stop = match later.stop {
        StopReason::Converged if later.score > earlier.score => StopReason::Evaluations,
        stop => stop,
    };
    let best = if later.score <= earlier.score { later.candidate } else { earlier.candidate };
    Replicate {
        number: earlier.number,
        candidate: best,
        score: earlier.score.min(later.score),
        evaluations,
        stop,
        convergence,
        near,
    }
}
