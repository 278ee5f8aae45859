//! Selects the candidates that run together: those of a call, sorted by delay and cut into blocks.

use super::core::Core;
use super::real::Real;
use super::simd::InstructionSet;
use super::time_loop::Candidate;
use crate::evaluator::{Case, EvaluateError, Job, Pace};
use crate::symbols::{Parameters, Symbol};

/// One block: candidates `from` to `to` - 1 of the order, all of one case.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    pub case: usize,
    /// Lanes of the block.
    pub lanes: usize,
    pub from: usize,
    pub to: usize,
}

/// Candidates that run together.
#[derive(Debug, Default)]
pub struct Plan {
    /// The candidates of all jobs, case by case.
    pub order: Vec<Candidate>,
    /// The blocks.
    pub parts: Vec<Part>,
}

/// Lanes of the blocks of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// This many in every block.
    Equal(usize),
    /// This many, but small blocks for the last candidates if [`SMALL`] of them suffice.
    Mixed(usize),
}

/// Measured time of a step of a small block in units of that of a large one: dispatch weighs on small blocks.
const SMALL_TIME: f64 = 0.42;
/// Largest number of small blocks that together take less time than a large one.
const SMALL: usize = 2;

impl<T: Real, const A: usize, const B: usize> Core<T, A, B> {
    /// Number of lanes of the largest blocks: the one with the least time for these jobs on this many threads.
    pub(super) fn lanes(&self, jobs: &[Job<'_>]) -> usize {
        if let Some(only) = self.only {
            return if A <= only && self.set != InstructionSet::Baseline { A } else { B };
        }
        // On a thread of the pool, the other threads are busy.
        let threads = if rayon::current_thread_index().is_some() { 1 } else { rayon::current_num_threads() };
        // Number of bytes that a step touches and that have to stay in the first-level cache.
        let longest = self.streams.iter().map(|s| s.longest).max().unwrap_or(0);
        let ring = if self.model.undelayed { 0 } else { 2 * (longest + 2) };
        let bytes = |lanes: usize| (self.model.busy + ring) * lanes * size_of::<T>();
        let mut of_cases = vec![0; self.streams.len()];
        jobs.iter().for_each(|job| of_cases[job.case] += job.population.len());
        let time = |lanes: usize, time: f64| {
            let crowded = if bytes(lanes) > 40 * 1024 { 1.25 } else { 1.0 };
            let blocks: usize = of_cases.iter().map(|candidates| candidates.div_ceil(lanes)).sum();
            blocks.div_ceil(threads) as f64 * time * crowded
        };
        // The baseline is compiled for small blocks only.
        if self.set != InstructionSet::Baseline && time(A, 1.0) <= time(B, SMALL_TIME) { A } else { B }
    }

    /// Sorts the candidates of each case by delay, whatever jobs they belong to, and cuts them into blocks.
    pub(super) fn plan(
        &self,
        cases: &[Case],
        jobs: &[Job<'_>],
        size: Size,
        plan: &mut Plan,
    ) -> Result<(), EvaluateError> {
        let Plan { order, parts } = plan;
        order.clear();
        parts.clear();
        let mut by_case: Vec<usize> = (0..jobs.len()).collect();
        by_case.sort_by_key(|job| jobs[*job].case);
        for of_case in by_case.chunk_by(|a, b| jobs[*a].case == jobs[*b].case) {
            let from = order.len();
            for job in of_case {
                self.append(cases, *job, &jobs[*job], order)?;
            }
            let to = order.len();
            order[from..].sort_unstable_by_key(|candidate| (candidate.back, candidate.job, candidate.index));
            let case = jobs[of_case[0]].case;
            let mut at = from;
            while at < to {
                let lanes = match size {
                    Size::Mixed(_) if to - at <= SMALL * B => B,
                    Size::Mixed(lanes) | Size::Equal(lanes) => lanes,
                };
                let part = Part { case, lanes, from: at, to: (at + lanes).min(to) };
                at = part.to;
                parts.push(part);
            }
        }
        Ok(())
    }

    /// Appends the candidates of a job.
    fn append(
        &self,
        cases: &[Case],
        number: usize,
        job: &Job<'_>,
        order: &mut Vec<Candidate>,
    ) -> Result<(), EvaluateError> {
        let (case, stream) = (&cases[job.case], &self.streams[job.case]);
        let extensions = case.variant.extensions;
        let timing = [Some(Symbol::tau_p), extensions.delay(), extensions.look_back()];
        let columns: Vec<(Symbol, usize)> = timing
            .into_iter()
            .flatten()
            .filter_map(|wanted| Some((wanted, job.population.symbols().iter().position(|s| *s == wanted)?)))
            .collect();
        let mut parameters = Parameters::NONE;
        for index in 0..job.population.len() {
            for (symbol, column) in &columns {
                parameters.set(*symbol, job.population.values(index)[*column]);
            }
            order.push(candidate(case, stream.longest, number, index, &parameters)?);
        }
        Ok(())
    }

    /// The plan of one job.
    pub(super) fn planned(&self, cases: &[Case], job: &Job<'_>, size: Size) -> Result<Plan, EvaluateError> {
        let mut plan = Plan::default();
        self.plan(cases, &[*job], size, &mut plan)?;
        Ok(plan)
    }
}

/// From the order of the blocks to that of the population of the one job.
pub fn in_order<R: Clone>(order: &[Candidate], sorted: impl Iterator<Item = R>, empty: R) -> Vec<R> {
    let mut results = vec![empty; order.len()];
    for (candidate, one) in order.iter().zip(sorted) {
        results[candidate.index] = one;
    }
    results
}

/// The start of a candidate, and the samples that it perceives.
pub fn candidate(
    case: &Case,
    longest: usize,
    job: usize,
    index: usize,
    parameters: &Parameters,
) -> Result<Candidate, EvaluateError> {
    let pace = case.pace(parameters);
    if pace.back > longest {
        let (name, upper, found) = (case.delay_name(), case.longest_delay(), case.delay(parameters));
        return Err(EvaluateError::Delay { name, upper, found });
    }
    let Pace { back, fraction, first, look_back, .. } = pace;
    Ok(Candidate { job, index, back, fraction, first, look_back })
}
