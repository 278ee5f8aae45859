//! Populations in blocks, spread over threads, in one precision.

use super::error::LanesError;
use super::model::Model;
use super::real::Real;
use super::run::{Candidate, Program, Run, Workspace};
use super::simd::{InstructionSet, run_block};
use super::stream::Stream;
use super::sums::Settings;
use crate::evaluator::{Case, EvaluateError, Failure, Job, Observed, Population, Raw, Score};
use crate::symbols::{Parameters, Symbol};
use rayon::prelude::*;
use std::sync::Mutex;

/// What one run tells: the score in the precision of the run, and everything raw.
#[derive(Debug, Clone, Copy)]
pub struct Finished {
    pub score: Score,
    pub raw: Raw,
}

/// The state at the samples before a traced run: spacing, speed, acceleration.
pub type History<'a> = [&'a [f64]; 3];

/// Blocks of one size.
#[derive(Debug)]
struct Blocks<T, const L: usize> {
    program: Program<T, L>,
    /// Workspaces that no thread uses now.
    idle: Mutex<Vec<Box<Workspace<T, L>>>>,
}

impl<T: Real, const L: usize> Blocks<T, L> {
    fn new(model: &Model, set: InstructionSet) -> Self {
        Blocks { program: Program::new(model, set), idle: Mutex::default() }
    }

    fn take(&self, longest: usize) -> Box<Workspace<T, L>> {
        let idle = self.idle.lock().map_or(None, |mut idle| idle.pop());
        idle.unwrap_or_else(|| Box::new(Workspace::new(&self.program.model, longest)))
    }

    fn put(&self, workspace: Box<Workspace<T, L>>) {
        if let Ok(mut idle) = self.idle.lock() {
            idle.push(workspace);
        }
    }
}

/// One block: candidates `range` of the order, of one job.
#[derive(Debug, Clone, Copy)]
struct Part {
    job: usize,
    from: usize,
    to: usize,
}

/// An evaluator in one precision, with two sizes of blocks: the large ones for large populations.
#[derive(Debug)]
pub struct Core<T, const A: usize, const B: usize> {
    pub streams: Vec<Stream<T>>,
    model: Model,
    set: InstructionSet,
    compensated: bool,
    large: Blocks<T, A>,
    small: Blocks<T, B>,
    /// Only blocks of this many lanes, for tests.
    only: Option<usize>,
    order: Vec<Candidate>,
    parts: Vec<Part>,
    sorted: Vec<Finished>,
}

impl<T: Real, const A: usize, const B: usize> Core<T, A, B> {
    pub fn new(streams: Vec<Stream<T>>, model: Model, compensated: bool, set: InstructionSet) -> Self {
        Core {
            streams,
            large: Blocks::new(&model, set),
            small: Blocks::new(&model, set),
            model,
            set,
            compensated,
            only: None,
            order: Vec::new(),
            parts: Vec::new(),
            sorted: Vec::new(),
        }
    }

    pub fn with(self, set: InstructionSet, only: Option<usize>) -> Self {
        Core { only, ..Core::new(self.streams, self.model, self.compensated, set) }
    }

    /// Lanes of a block: the size with the least time for so many candidates on so many threads.
    fn lanes(&self, candidates: usize) -> usize {
        if let Some(only) = self.only {
            return if A <= only && self.set != InstructionSet::Baseline { A } else { B };
        }
        let threads = rayon::current_num_threads();
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
    fn plan(&mut self, cases: &[Case], jobs: &[Job<'_>]) -> Result<usize, EvaluateError> {
        let lanes = self.lanes(Job::candidates(jobs));
        self.order.clear();
        self.parts.clear();
        for (k, job) in jobs.iter().enumerate() {
            let (case, stream) = (&cases[job.case], &self.streams[job.case]);
            let from = self.order.len();
            let tau_p = job.population.symbols().iter().position(|symbol| *symbol == Symbol::tau_p);
            let mut parameters = Parameters::NONE;
            for index in 0..job.population.len() {
                parameters.tau_p = tau_p.map_or(f64::NAN, |column| job.population.values(index)[column]);
                let pace = case.pace(&parameters);
                if pace.back > stream.longest {
                    return Err(EvaluateError::Delay { upper: case.tau_p_upper, found: parameters.tau_p });
                }
                self.order.push(Candidate { index, back: pace.back, fraction: pace.fraction, first: pace.first });
            }
            let to = self.order.len();
            self.order[from..].sort_unstable_by_key(|candidate| (candidate.back, candidate.index));
            self.parts.extend((from..to).step_by(lanes).map(|at| Part { job: k, from: at, to: (at + lanes).min(to) }));
        }
        Ok(lanes)
    }

    fn columns(&self, population: &Population) -> Vec<Option<usize>> {
        let column = |name: &str| population.symbols().iter().position(|symbol| symbol.name() == name);
        self.model.parameters.iter().map(|(name, _)| column(name)).collect()
    }

    /// Runs all candidates of the jobs; `results` has them in the order of the jobs.
    pub fn run(
        &mut self,
        cases: &[Case],
        jobs: &[Job<'_>],
        settings: &Settings<T>,
        results: &mut Vec<Finished>,
    ) -> Result<(), EvaluateError> {
        let lanes = self.plan(cases, jobs)?;
        let nothing = Finished { score: Score::Rejected, raw: Raw::default() };
        let mut sorted = std::mem::take(&mut self.sorted);
        sorted.clear();
        sorted.resize(self.order.len(), nothing);
        let mut rest = sorted.as_mut_slice();
        let mut work = Vec::with_capacity(self.parts.len());
        for part in &self.parts {
            let (mine, others) = rest.split_at_mut(part.to - part.from);
            work.push((*part, mine));
            rest = others;
        }
        let columns: Vec<_> = jobs.iter().map(|job| self.columns(job.population)).collect();
        work.into_par_iter().for_each(|(part, results)| {
            let job = &jobs[part.job];
            let mut run = self.prepare(job, settings, &columns[part.job], &self.order[part.from..part.to]);
            if lanes == A {
                self.finish(&self.large, &mut run, results);
            } else {
                self.finish(&self.small, &mut run, results);
            }
        });
        results.clear();
        results.resize(sorted.len(), nothing);
        let mut first = 0;
        let mut at = 0;
        for job in jobs {
            let count = job.population.len();
            for (candidate, finished) in self.order[at..at + count].iter().zip(&sorted[at..]) {
                results[first + candidate.index] = *finished;
            }
            at += count;
            first += count;
        }
        self.sorted = sorted;
        Ok(())
    }

    fn prepare<'a>(
        &'a self,
        job: &Job<'a>,
        settings: &'a Settings<T>,
        columns: &'a [Option<usize>],
        candidates: &'a [Candidate],
    ) -> Run<'a, T> {
        let stream = &self.streams[job.case];
        Run {
            settings,
            stream,
            population: job.population,
            columns,
            candidates,
            history: None,
            end: stream.samples(),
            trace: None,
        }
    }

    fn finish<const L: usize>(&self, blocks: &Blocks<T, L>, run: &mut Run<'_, T>, results: &mut [Finished]) {
        let mut workspace = blocks.take(self.longest());
        run_block(self.set, &blocks.program, &mut workspace, run);
        for (lane, (result, candidate)) in results.iter_mut().zip(run.candidates).enumerate() {
            let raw = workspace.raw(lane, run.settings);
            let score = match raw.failure() {
                Some(Failure { kind, step }) => Score::Failed(Failure { kind, step }),
                None if run.stream.rejects && raw.n_cut_acc + raw.n_cut_dec > 0 => Score::Rejected,
                None => Score::Value(workspace.sums.score(lane, run.settings, &run.stream.norms[candidate.first])),
            };
            *result = Finished { score, raw };
        }
        blocks.put(workspace);
    }

    fn longest(&self) -> usize {
        self.streams.iter().map(|stream| stream.longest).max().unwrap_or(0)
    }

    /// Runs with an observer; they are few, so in small blocks.
    pub fn observed(
        &mut self,
        cases: &[Case],
        job: &Job<'_>,
        settings: &Settings<T>,
    ) -> Result<Vec<Observed>, EvaluateError> {
        let only = self.only.replace(B);
        let planned = self.plan(cases, &[*job]);
        self.only = only;
        planned?;
        let columns = self.columns(job.population);
        let several: Vec<Vec<Observed>> = self
            .parts
            .par_iter()
            .map(|part| {
                let mut run = self.prepare(job, settings, &columns, &self.order[part.from..part.to]);
                self.observe(&self.small, &mut run)
            })
            .collect();
        let empty = Observed { raw: Raw::default(), blocks: Vec::new() };
        let mut results = vec![empty; self.order.len()];
        for (candidate, observed) in self.order.iter().zip(several.into_iter().flatten()) {
            results[candidate.index] = observed;
        }
        Ok(results)
    }

    fn observe<const L: usize>(&self, blocks: &Blocks<T, L>, run: &mut Run<'_, T>) -> Vec<Observed> {
        let mut workspace = blocks.take(self.longest());
        run_block(self.set, &blocks.program, &mut workspace, run);
        let lane = |lane: usize| Observed {
            raw: workspace.raw(lane, run.settings),
            blocks: workspace
                .sums
                .blocks
                .iter()
                .map(|sums| [sums[0].0[lane], sums[1].0[lane]].map(T::to_f64))
                .collect(),
        };
        let observed = (0..run.candidates.len()).map(lane).collect();
        blocks.put(workspace);
        observed
    }

    /// The states of one candidate from sample `from` to `to` - 1, after a given past.
    pub fn trace(
        &self,
        case: &Case,
        index: usize,
        population: &Population,
        settings: &Settings<T>,
        history: History<'_>,
        to: usize,
    ) -> Result<Vec<[f64; 3]>, EvaluateError> {
        let from = history[0].len();
        let parameters = population.parameters(0);
        let pace = case.pace(&parameters);
        let stream = &self.streams[index];
        if pace.back > stream.longest {
            return Err(EvaluateError::Delay { upper: case.tau_p_upper, found: parameters.tau_p });
        }
        let past: Vec<[T; 3]> = (0..from).map(|t| [0, 1, 2].map(|k| T::of(history[k][t]))).collect();
        let candidate = Candidate { index: 0, back: pace.back, fraction: pace.fraction, first: from };
        let mut states = Vec::new();
        let columns = self.columns(population);
        let mut run = Run {
            settings,
            stream,
            population,
            columns: &columns,
            candidates: &[candidate],
            history: Some(&past),
            end: to.min(stream.samples()),
            trace: Some(&mut states),
        };
        let mut workspace = self.small.take(self.longest());
        run_block(self.set, &self.small.program, &mut workspace, &mut run);
        self.small.put(workspace);
        Ok(states.split_off(from.min(states.len())))
    }
}

impl<T: Real, const L: usize> Workspace<T, L> {
    fn raw(&self, lane: usize, settings: &Settings<T>) -> Raw {
        let totals = self.sums.totals(lane, settings.compensated);
        let [error2, simulated2, relative2, floored2] = totals.map(|sum| sum.map(T::to_f64));
        Raw {
            status: self.status[lane],
            n_cut_acc: self.cut_acc[lane],
            n_cut_dec: self.cut_dec[lane],
            error2,
            simulated2,
            relative2,
            floored2_v: floored2[1],
        }
    }
}

impl From<LanesError> for EvaluateError {
    fn from(error: LanesError) -> Self {
        EvaluateError::Model(Box::new(error))
    }
}
