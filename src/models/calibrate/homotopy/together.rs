//! Searches side by side whose simulations share blocks.
//!
//! A search asks for a few simulations at a time, which fill a block of lanes by half. Searches on the same cases advance in turns: each up
//! to its next request, then all requests of a kind are simulated together. A lane does not depend on its neighbours, so results are those of
//! each search alone.

use super::{Detail, Ground};
use crate::evaluator::{Differences, EvaluateError, Job, Population, Pull, Score, Slopes};
use crate::symbols::Symbol;
use rayon::prelude::*;
use std::cell::RefCell;
use std::future::{Future, poll_fn};
use std::ops::Range;
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

/// Candidates at most whose derivatives are computed together: two blocks, so that their residuals stay in the cache.
const CANDIDATES: usize = 128;

/// How candidates are simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct How {
    pub detail: Detail,
    pub cases: Range<usize>,
    pub pull: Pull,
}

/// A wanted simulation of candidates.
struct Request {
    how: How,
    symbols: Vec<Symbol>,
    candidates: Vec<Vec<f64>>,
    what: What,
}

/// The numbers that are wanted; where they will lie, case by case.
enum What {
    Scores(Slot<(Score, f64)>),
    Slopes(Vec<Differences>, Slot<Slopes>),
}

type Slot<R> = Rc<RefCell<Option<Vec<Vec<R>>>>>;

/// Requests that wait.
#[derive(Default)]
pub struct Queue {
    waiting: RefCell<Vec<Request>>,
}

impl Queue {
    /// Scores of candidates and their squared shortfalls, case by case.
    pub async fn scores(&self, how: &How, symbols: &[Symbol], candidates: Vec<Vec<f64>>) -> Vec<Vec<(Score, f64)>> {
        self.answer(how, symbols, candidates, What::Scores).await
    }

    /// Derivatives, case by case.
    pub async fn slopes(
        &self,
        how: &How,
        symbols: &[Symbol],
        candidates: Vec<Vec<f64>>,
        differences: Vec<Differences>,
    ) -> Vec<Vec<Slopes>> {
        self.answer(how, symbols, candidates, |slot| What::Slopes(differences, slot)).await
    }

    fn answer<R>(
        &self,
        how: &How,
        symbols: &[Symbol],
        candidates: Vec<Vec<f64>>,
        what: impl FnOnce(Slot<R>) -> What,
    ) -> impl Future<Output = Vec<Vec<R>>> {
        let slot = Slot::<R>::default();
        let what = what(slot.clone());
        self.waiting.borrow_mut().push(Request { how: how.clone(), symbols: symbols.to_vec(), candidates, what });
        poll_fn(move |_| slot.borrow_mut().take().map_or(Poll::Pending, Poll::Ready))
    }

    /// Answers all requests.
    fn work(&self, ground: &Ground) -> Result<(), EvaluateError> {
        let mut waiting = self.waiting.take();
        while let Some(first) = waiting.first() {
            let (how, slopes) = (first.how.clone(), matches!(first.what, What::Slopes(..)));
            let alike = |request: &Request| request.how == how && matches!(request.what, What::Slopes(..)) == slopes;
            let (alike, others) = waiting.into_iter().partition(alike);
            waiting = others;
            if slopes { slopes_of(ground, &how, alike)? } else { scores_of(ground, &how, alike)? }
        }
        Ok(())
    }
}

fn scores_of(ground: &Ground, how: &How, requests: Vec<Request>) -> Result<(), EvaluateError> {
    let mut population = Population::new(&requests[0].symbols);
    requests.iter().flat_map(|request| &request.candidates).for_each(|candidate| population.push(candidate));
    let lanes = ground.lanes(how.detail);
    let of = |case: usize| lanes.pulled(&Job { case, population: &population }, how.pull);
    let by_case: Vec<_> = how.cases.clone().into_par_iter().map(of).collect::<Result<_, _>>()?;
    let mut from = 0;
    for Request { candidates, what, .. } in requests {
        let own = from..from + candidates.len();
        from = own.end;
        if let What::Scores(slot) = what {
            *slot.borrow_mut() = Some(by_case.iter().map(|scores| scores[own.clone()].to_vec()).collect());
        }
    }
    Ok(())
}

fn slopes_of(ground: &Ground, how: &How, requests: Vec<Request>) -> Result<(), EvaluateError> {
    let symbols = requests[0].symbols.clone();
    // Candidates and differences in parts of nearly as many candidates as run together.
    let mut parts: Vec<(Population, Vec<Differences>)> = Vec::new();
    let mut slots = Vec::new();
    for Request { candidates, what, .. } in requests {
        let What::Slopes(differences, slot) = what else { continue };
        slots.push((differences.len(), slot));
        for Differences { first, steps } in differences {
            let own = &candidates[first..=first + steps.len()];
            if parts.last().is_none_or(|(population, _)| population.len() + own.len() > CANDIDATES) {
                parts.push((Population::new(&symbols), Vec::new()));
            }
            let (population, differences) = parts.last_mut().expect("pushed above");
            differences.push(Differences { first: population.len(), steps });
            own.iter().for_each(|candidate| population.push(candidate));
        }
    }
    let lanes = ground.lanes(how.detail);
    let of = |case: usize| -> Result<Vec<Slopes>, EvaluateError> {
        let of_part = |(population, differences): &(Population, Vec<Differences>)| {
            lanes.slopes(&Job { case, population }, differences, how.pull)
        };
        let several: Vec<Vec<Slopes>> = parts.par_iter().map(of_part).collect::<Result<_, _>>()?;
        Ok(several.into_iter().flatten().collect())
    };
    let by_case: Vec<Vec<Slopes>> = how.cases.clone().into_par_iter().map(of).collect::<Result<_, _>>()?;
    let mut by_case: Vec<_> = by_case.into_iter().map(Vec::into_iter).collect();
    for (count, slot) in slots {
        *slot.borrow_mut() = Some(by_case.iter_mut().map(|slopes| slopes.take(count).collect()).collect());
    }
    Ok(())
}

/// Runs searches that put their requests in a queue; their results in order.
pub fn run<R>(
    ground: &Ground,
    queue: &Queue,
    searches: Vec<Pin<Box<dyn Future<Output = R> + '_>>>,
) -> Result<Vec<R>, EvaluateError> {
    let mut results: Vec<Option<R>> = searches.iter().map(|_| None).collect();
    let mut going: Vec<_> = searches.into_iter().enumerate().collect();
    loop {
        going.retain_mut(|(i, search)| match search.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(result) => {
                results[*i] = Some(result);
                false
            }
            Poll::Pending => true,
        });
        if going.is_empty() {
            return Ok(results.into_iter().flatten().collect());
        }
        queue.work(ground)?;
    }
}
