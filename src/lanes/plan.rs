//! Who runs beside whom: the candidates of a call, sorted by delay and cut into blocks.

use super::core::Core;
use super::real::Real;
use super::run::Candidate;
use super::simd::InstructionSet;
use crate::evaluator::{Case, EvaluateError, Job, Pace};
use crate::symbols::{Parameters, Symbol};

/// One block: candidates `range` of the order, of one job.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    pub job: usize,
    pub from: usize,
    pub to: usize,
}

/// Who runs beside whom.
#[derive(Debug, Default)]
pub struct Plan {
    /// Lanes of a block.
    pub lanes: usize,
    /// The candidates of all jobs.
    pub order: Vec<Candidate>,
    /// The blocks.
    pub parts: Vec<Part>,
}

impl<T: Real, const A: usize, const B: usize> Core<T, A, B> {
    /// Lanes of a block: the size with the least time for so many candidates on so many threads.
    pub(super) fn lanes(&self, candidates: usize) -> usize {
        if let Some(only) = self.only {
            return if A <= only && self.set != InstructionSet::Baseline { A } else { B };
        }
        // On a thread of the pool, the others have work of their own.
        let threads = if rayon::current_thread_index().is_some() { 1 } else { rayon::current_num_threads() };
        // Bytes that a step touches and that have to stay in the nearest cache.
        let longest = self.streams.iter().map(|s| s.longest).max().unwrap_or(0);
        let ring = if self.model.undelayed { 0 } else { 2 * (longest + 2) };
        let bytes = |lanes: usize| (self.model.busy + ring) * lanes * size_of::<T>();
        // Measured time of a step per block, relative: dispatch weighs on small blocks.
        let sizes = [(A, 1.0), (B, 0.42)];
        let time = |(lanes, time): (usize, f64)| {
            let crowded = if bytes(lanes) > 40 * 1024 { 1.25 } else { 1.0 };
            candidates.div_ceil(lanes).div_ceil(threads) as f64 * time * crowded
        };
        // The baseline is compiled for small blocks only.
        let sizes = if self.set == InstructionSet::Baseline { &sizes[1..] } else { &sizes[..] };
        sizes.iter().min_by(|a, b| time(**a).total_cmp(&time(**b))).expect("there are sizes").0
    }

    /// Sorts the candidates of each job by delay and cuts them into blocks.
    pub(super) fn plan(
        &self,
        cases: &[Case],
        jobs: &[Job<'_>],
        lanes: usize,
        plan: &mut Plan,
    ) -> Result<(), EvaluateError> {
        let Plan { order, parts, .. } = plan;
        order.clear();
        parts.clear();
        for (k, job) in jobs.iter().enumerate() {
            let (case, stream) = (&cases[job.case], &self.streams[job.case]);
            let from = order.len();
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
                order.push(candidate(case, stream.longest, index, &parameters)?);
            }
            let to = order.len();
            order[from..].sort_unstable_by_key(|candidate| (candidate.back, candidate.index));
            parts.extend((from..to).step_by(lanes).map(|at| Part { job: k, from: at, to: (at + lanes).min(to) }));
        }
        plan.lanes = lanes;
        Ok(())
    }

    /// The plan of one job.
    pub(super) fn planned(&self, cases: &[Case], job: &Job<'_>, lanes: usize) -> Result<Plan, EvaluateError> {
        let mut plan = Plan::default();
        self.plan(cases, &[*job], lanes, &mut plan)?;
        Ok(plan)
    }
}

/// From the order of the blocks to that of the population.
pub fn in_order<R: Clone>(order: &[Candidate], sorted: impl Iterator<Item = R>, empty: R) -> Vec<R> {
    let mut results = vec![empty; order.len()];
    for (candidate, one) in order.iter().zip(sorted) {
        results[candidate.index] = one;
    }
    results
}

/// When a candidate perceives and starts.
pub fn candidate(
    case: &Case,
    longest: usize,
    index: usize,
    parameters: &Parameters,
) -> Result<Candidate, EvaluateError> {
    let pace = case.pace(parameters);
    if pace.back > longest {
        let (name, upper, found) = (case.delay_name(), case.longest_delay(), case.delay(parameters));
        return Err(EvaluateError::Delay { name, upper, found });
    }
    let Pace { back, fraction, first, look_back, .. } = pace;
    Ok(Candidate { index, back, fraction, first, look_back })
}
