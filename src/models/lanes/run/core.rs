//! Populations in blocks, spread over threads, in one precision.

use super::plan::{Part, Plan, Size, candidate, in_order};
use super::products::{Adder, Bins, Squares};
use super::real::Real;
use super::simd::{InstructionSet, run_block};
use super::stream::Stream;
use super::sums::Settings;
use super::time_loop::{Candidate, Program, Run, Workspace};
use crate::evaluator::{
    Case, Differences, EvaluateError, Failure, Innovations, Job, Observed, Observer, Population, Products, Raw,
    Residuals, SIGNALS, Score, Slopes,
};
use crate::lanes::compile::error::LanesError;
use crate::lanes::compile::model::Model;
use crate::wgsl::is_member;
use rayon::prelude::*;
use std::any::TypeId;
use std::sync::Mutex;

/// Result of one run: the score in the precision of the run, and all raw values.
#[derive(Debug, Clone, Copy)]
pub struct Finished {
    pub score: Score,
    pub raw: Raw,
}

/// The state at the samples before a traced run: spacing, speed, acceleration.
pub type History<'a> = [&'a [f64]; 3];

/// Traced values of a candidate.
#[derive(Debug, Clone, Copy)]
pub struct Traces<'a> {
    /// First sample of each trace.
    pub from: &'a [usize],
    /// Added to spacing, speed and acceleration right before each of these; may be empty.
    pub kicks: &'a [[f64; 3]],
    /// One past the last sample.
    pub to: usize,
}

/// A job whose runs are corrected towards the measurement.
#[derive(Debug, Clone, Copy)]
pub struct Observing<'a> {
    pub cases: &'a [Case],
    pub job: &'a Job<'a>,
    pub settings: &'a Settings,
    /// One per candidate; none for free runs.
    pub observers: &'a [Observer],
}

/// Blocks of one size.
#[derive(Debug)]
struct Blocks<T, const L: usize> {
    program: Program<T, L>,
    /// Idle workspaces.
    idle: Mutex<Vec<Box<Workspace<T, L>>>>,
}

impl<T: Real, const L: usize> Blocks<T, L> {
    fn new(model: &Model, set: InstructionSet) -> Self {
        Blocks { program: Program::new(model, set), idle: Mutex::default() }
    }

    fn take(&self, longest: usize) -> Box<Workspace<T, L>> {
        let idle = self.idle.lock().map_or(None, |mut idle| idle.pop());
        idle.unwrap_or_else(|| Box::new(Workspace::new(&self.program, longest)))
    }

    fn put(&self, workspace: Box<Workspace<T, L>>) {
        if let Ok(mut idle) = self.idle.lock() {
            idle.push(workspace);
        }
    }
}

/// Number of samples between two readings of a block's residuals: so few that they stay in the cache, and so many that the interruption
/// costs nothing.
const STRETCH: usize = 128;

/// Values that runs store at each sample; the discriminant is their number.
#[derive(Debug, Clone, Copy)]
enum Leaving {
    /// Residuals of spacing and speed.
    Residuals = 2,
    /// Residuals that the goodness of fit squares.
    Weighted = SIGNALS as isize,
}

/// An evaluator in one precision, with two sizes of blocks: the large ones for large populations.
#[derive(Debug)]
pub struct Core<T, const A: usize, const B: usize> {
    pub streams: Vec<Stream<T>>,
    pub(super) model: Model,
    pub(super) set: InstructionSet,
    compensated: bool,
    large: Blocks<T, A>,
    small: Blocks<T, B>,
    /// Only blocks of this many lanes, for tests.
    pub(super) only: Option<usize>,
    /// Memory that runs reuse.
    plan: Plan,
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
            plan: Plan::default(),
            sorted: Vec::new(),
        }
    }

    pub fn with(self, set: InstructionSet, only: Option<usize>) -> Self {
        Core { only, ..Core::new(self.streams, self.model, self.compensated, set) }
    }

    /// For each job, the column of each of the model's parameters.
    fn columns(&self, jobs: &[Job<'_>]) -> Vec<Vec<Option<usize>>> {
        let columns = |job: &Job| {
            let symbols = job.population.symbols();
            let mut next = 0;
            // The orders mostly agree, so a search begins after the last one found.
            let mut column = |name: &str| {
                let found = (next..symbols.len()).chain(0..next).find(|&k| is_member(symbols[k], name));
                next = found.map_or(next, |k| k + 1);
                found
            };
            self.model.parameters.iter().map(|(name, _)| column(name)).collect()
        };
        jobs.iter().map(columns).collect()
    }

    /// Runs all candidates of the jobs; `results` has them in the order of the jobs.
    pub fn run(
        &mut self,
        cases: &[Case],
        jobs: &[Job<'_>],
        settings: &Settings,
        results: &mut Vec<Finished>,
    ) -> Result<(), EvaluateError> {
        let mut plan = std::mem::take(&mut self.plan);
        self.plan(cases, jobs, Size::Mixed(self.lanes(jobs)), &mut plan)?;
        let nothing = Finished { score: Score::Rejected, raw: Raw::default() };
        let mut sorted = std::mem::take(&mut self.sorted);
        sorted.clear();
        sorted.resize(plan.order.len(), nothing);
        let mut rest = sorted.as_mut_slice();
        let mut work = Vec::with_capacity(plan.parts.len());
        for part in &plan.parts {
            let (mine, others) = rest.split_at_mut(part.to - part.from);
            work.push((part, mine));
            rest = others;
        }
        let columns = self.columns(jobs);
        work.into_par_iter().for_each(|(part, results)| {
            let mut run = self.prepare(jobs, settings, &columns, &plan, part);
            if part.lanes == A {
                self.finish(&self.large, &mut run, results);
            } else {
                self.finish(&self.small, &mut run, results);
            }
        });
        results.clear();
        results.resize(sorted.len(), nothing);
        let begin = |next: &mut usize, job: &Job| {
            *next += job.population.len();
            Some(*next - job.population.len())
        };
        let begins: Vec<usize> = jobs.iter().scan(0, begin).collect();
        for (candidate, finished) in plan.order.iter().zip(&sorted) {
            results[begins[candidate.job] + candidate.index] = *finished;
        }
        (self.sorted, self.plan) = (sorted, plan);
        Ok(())
    }

    fn prepare<'a>(
        &'a self,
        jobs: &'a [Job<'a>],
        settings: &'a Settings,
        columns: &'a [Vec<Option<usize>>],
        plan: &'a Plan,
        part: &Part,
    ) -> Run<'a, T> {
        let stream = &self.streams[part.case];
        Run {
            settings,
            stream,
            jobs,
            columns,
            candidates: &plan.order[part.from..part.to],
            history: None,
            kicks: &[],
            end: stream.samples(),
            trace: None,
            observers: &[],
            record: None,
            residuals: None,
            weighted: None,
        }
    }

    fn run_whole<const L: usize>(
        &self,
        program: &Program<T, L>,
        workspace: &mut Workspace<T, L>,
        run: &mut Run<'_, T>,
    ) {
        workspace.begin(program, run);
        let end = run.end;
        run_block(self.set, program, workspace, run, end);
    }

    fn finish<const L: usize>(&self, blocks: &Blocks<T, L>, run: &mut Run<'_, T>, results: &mut [Finished]) {
        let mut workspace = blocks.take(self.longest());
        self.run_whole(&blocks.program, &mut workspace, run);
        for (lane, (result, candidate)) in results.iter_mut().zip(run.candidates).enumerate() {
            let raw = workspace.raw(lane, run.settings);
            *result = Finished { score: workspace.score(lane, candidate, run), raw };
        }
        blocks.put(workspace);
    }

    fn longest(&self) -> usize {
        self.streams.iter().map(|stream| stream.longest).max().unwrap_or(0)
    }

    /// What `read` returns of every part of a job, for blocks of one of the two sizes, in the order of the population.
    fn in_parts<R: Clone + Send>(
        &self,
        of: Observing<'_>,
        size: Size,
        empty: R,
        read: impl Fn(Run<'_, T>, bool) -> Vec<R> + Sync,
    ) -> Result<Vec<R>, EvaluateError> {
        let plan = self.planned(of.cases, of.job, size)?;
        let (jobs, columns) = ([*of.job], self.columns(&[*of.job]));
        let one = |part: &Part| {
            let run = self.prepare(&jobs, of.settings, &columns, &plan, part);
            read(Run { observers: of.observers, ..run }, part.lanes == A)
        };
        let several: Vec<Vec<R>> = plan.parts.par_iter().map(one).collect();
        Ok(in_order(&plan.order, several.into_iter().flatten(), empty))
    }

    /// The sums of runs.
    pub fn observed(&self, of: Observing<'_>) -> Result<Vec<Observed>, EvaluateError> {
        let empty = Observed { raw: Raw::default(), blocks: Vec::new() };
        self.in_parts(of, Size::Mixed(self.lanes(&[*of.job])), empty, |mut run, is_large| match is_large {
            true => self.observe(&self.large, &mut run),
            false => self.observe(&self.small, &mut run),
        })
    }

    fn observe<const L: usize>(&self, blocks: &Blocks<T, L>, run: &mut Run<'_, T>) -> Vec<Observed> {
        let mut workspace = blocks.take(self.longest());
        self.run_whole(&blocks.program, &mut workspace, run);
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

    /// Runs sample by sample; in small blocks, because all their samples are stored.
    pub fn innovations(&self, of: Observing<'_>) -> Result<Vec<Innovations>, EvaluateError> {
        let empty =
            Innovations { failed: None, first: 0, residual: Vec::new(), state: Vec::new(), acceleration: Vec::new() };
        self.in_parts(of, Size::Equal(B), empty, |run, _| self.record(run))
    }

    fn record(&self, run: Run<'_, T>) -> Vec<Innovations> {
        let mut workspace = self.small.take(self.longest());
        let mut record = Vec::new();
        let (candidates, settings, samples) = (run.candidates, run.settings, run.stream.samples());
        self.run_whole(&self.small.program, &mut workspace, &mut Run { record: Some(&mut record), ..run });
        let width = candidates.len();
        let begun = |lane: usize| Innovations {
            failed: workspace.raw(lane, settings).failure(),
            first: candidates[lane].first,
            residual: Vec::with_capacity(samples),
            state: Vec::with_capacity(samples),
            acceleration: Vec::with_capacity(samples),
        };
        let mut all: Vec<Innovations> = (0..width).map(begun).collect();
        let recorded = record.len() / width;
        let ends: Vec<usize> = all.iter().map(|run| run.failed.map_or(samples, |f| f.step).min(recorded)).collect();
        // Sample by sample, as recorded: reading lane by lane would miss the caches.
        for t in 0..samples {
            for (lane, (run, end)) in all.iter_mut().zip(&ends).enumerate() {
                let row = if t < *end { record[t * width + lane] } else { [f64::NAN; 6] };
                run.residual.push([row[0], row[1]]);
                run.state.push([row[2], row[3], row[4]]);
                run.acceleration.push(row[5]);
            }
        }
        self.small.put(workspace);
        all
    }

    /// Only the residuals of runs, stretch by stretch, for fits.
    pub fn residuals(
        &self,
        of: Observing<'_>,
        each: &mut dyn FnMut(&Residuals),
    ) -> Result<Vec<Option<Failure>>, EvaluateError> {
        Ok(self.stretches(of, Leaving::Residuals, each)?.1)
    }

    /// Runs stretch by stretch, in the order of the population; which failed.
    fn stretches(
        &self,
        Observing { cases, job, settings, observers }: Observing<'_>,
        what: Leaving,
        each: &mut dyn FnMut(&Residuals),
    ) -> Result<(Plan, Vec<Option<Failure>>), EvaluateError> {
        let lanes = self.lanes(&[*job]);
        let mut plan = self.planned(cases, job, Size::Equal(lanes))?;
        plan.order.sort_unstable_by_key(|candidate| candidate.index);
        let (jobs, columns) = ([*job], self.columns(&[*job]));
        let prepare = |part: &Part| {
            let run = self.prepare(&jobs, settings, &columns, &plan, part);
            Run { observers, ..run }
        };
        let runs = plan.parts.iter().map(prepare).collect();
        let failed = if lanes == A {
            self.leave(&self.large, runs, what, each)
        } else {
            self.leave(&self.small, runs, what, each)
        };
        Ok((plan, failed))
    }

    /// Scores of runs, and their shortfalls.
    pub fn soft_scores(&self, of: Observing<'_>) -> Result<Vec<(Score, f64)>, EvaluateError> {
        self.in_parts(of, Size::Mixed(self.lanes(&[*of.job])), (Score::Rejected, 0.0), |mut run, is_large| {
            match is_large {
                true => self.soft_score(&self.large, &mut run),
                false => self.soft_score(&self.small, &mut run),
            }
        })
    }

    fn soft_score<const L: usize>(&self, blocks: &Blocks<T, L>, run: &mut Run<'_, T>) -> Vec<(Score, f64)> {
        let mut workspace = blocks.take(self.longest());
        self.run_whole(&blocks.program, &mut workspace, run);
        let lane =
            |(lane, candidate)| (workspace.score(lane, candidate, run), workspace.sums.shortfall2.0[lane].to_f64());
        let scores = run.candidates.iter().enumerate().map(lane).collect();
        blocks.put(workspace);
        scores
    }

    /// Scores with derivatives, in the order of `differences`; those of a run that fails are infinite.
    pub fn slopes(&self, of: Observing<'_>, differences: &[Differences]) -> Result<Vec<Slopes>, EvaluateError> {
        let (plan, failed, products) = self.added(of, differences, Bins::ONE)?;
        let slopes = |(products, differences): (&Products<'_>, &Differences)| {
            let norm = &self.streams[of.job.case].norms[plan.order[differences.first].first];
            let weights = [0, 1, 2].map(|k| [norm.weight[k], norm.per_count[k]].map(T::to_f64));
            let mut slopes = products.slopes(weights, of.settings.soft.map_or(0.0, |soft| soft.price));
            if failed[differences.group()].iter().any(Option::is_some) {
                slopes.cost = f64::INFINITY;
            }
            slopes
        };
        Ok(products.iter().zip(differences).map(slopes).collect())
    }

    /// Sums of products over the bins of runs, in the order of `differences`; `None` for a run that fails.
    pub fn products<'a>(
        &self,
        of: Observing<'_>,
        (differences, bins): (&'a [Differences], Bins<'a>),
    ) -> Result<Vec<Option<Products<'a>>>, EvaluateError> {
        let (_, failed, products) = self.added(of, differences, bins)?;
        let ran = |of: &Differences| failed[of.group()].iter().all(Option::is_none);
        Ok(products.into_iter().zip(differences).map(|(products, of)| ran(of).then_some(products)).collect())
    }

    /// The sums of all groups, whether or not their runs failed.
    #[allow(clippy::type_complexity, reason = "the plan, which runs failed, the sums")]
    fn added<'a>(
        &self,
        of: Observing<'_>,
        differences: &'a [Differences],
        bins: Bins<'a>,
    ) -> Result<(Plan, Vec<Option<Failure>>, Vec<Products<'a>>), EvaluateError> {
        let is_f32 = TypeId::of::<T>() == TypeId::of::<f32>();
        let mut adders: Vec<Adder<'_>> = differences.iter().map(|own| Adder::new(own, bins, is_f32)).collect();
        let mut each = |stretch: &Residuals| adders.par_iter_mut().for_each(|adder| adder.add(stretch));
        let (plan, failed) = self.stretches(of, Leaving::Weighted, &mut each)?;
        Ok((plan, failed, adders.into_iter().map(Adder::done).collect()))
    }

    /// Sums of squares over the bins of runs, in the order of the population; `None` for a run that fails.
    pub fn squares(
        &self,
        of: Observing<'_>,
        bins: Bins<'_>,
    ) -> Result<Vec<Option<Vec<[f64; SIGNALS]>>>, EvaluateError> {
        let mut squares = Squares::new(bins);
        let mut each = |stretch: &Residuals| squares.add(stretch);
        let (_, failed) = self.stretches(of, Leaving::Weighted, &mut each)?;
        Ok(failed.iter().enumerate().map(|(i, failed)| failed.is_none().then(|| squares.of(i))).collect())
    }

    /// Residuals whose squares add up to the goodness of fit, one vector per candidate: spacing, speed and acceleration, sample by sample.
    pub fn norm_residuals(&self, of: Observing<'_>) -> Result<Vec<Vec<f64>>, EvaluateError> {
        let samples = self.streams[of.job.case].samples();
        let mut all = vec![vec![0.0; 3 * samples]; of.job.population.len()];
        let mut each = |stretch: &Residuals| {
            all.par_iter_mut().enumerate().for_each(|(candidate, residuals)| {
                for (signal, residuals) in residuals.chunks_exact_mut(samples).enumerate() {
                    let numbers = stretch.signal(candidate, signal);
                    residuals[stretch.from..].iter_mut().zip(numbers).for_each(|(residual, number)| *residual = number);
                }
            });
        };
        let (plan, _) = self.stretches(of, Leaving::Weighted, &mut each)?;
        for (residuals, candidate) in all.iter_mut().zip(&plan.order) {
            let norm = &self.streams[of.job.case].norms[candidate.first];
            for (signal, residuals) in residuals.chunks_exact_mut(samples).enumerate() {
                let [weight, per_count] = [norm.weight[signal], norm.per_count[signal]].map(T::to_f64);
                let square: f64 = residuals.iter().map(|error| error * error).sum();
                let factor = if square > 0.0 { (weight * (per_count / square).sqrt()).sqrt() } else { 0.0 };
                residuals.iter_mut().for_each(|error| *error *= factor);
            }
        }
        Ok(all)
    }

    /// All blocks advance by a stretch of samples, and pass their residuals to `each`; finally, which runs failed.
    fn leave<const L: usize>(
        &self,
        blocks: &Blocks<T, L>,
        runs: Vec<Run<'_, T>>,
        what: Leaving,
        each: &mut dyn FnMut(&Residuals),
    ) -> Vec<Option<Failure>> {
        let begun = |run| {
            let mut workspace = blocks.take(self.longest());
            workspace.begin(&blocks.program, &run);
            (run, workspace)
        };
        let mut begun: Vec<_> = runs.into_iter().map(begun).collect();
        let signals = what as usize;
        let mut stretch = Residuals {
            lanes: L,
            from: 0,
            samples: 0,
            signals,
            blocks: begun.iter_mut().map(|(_, workspace)| std::mem::take(&mut workspace.leaving)).collect(),
        };
        while begun.iter().any(|(run, workspace)| !workspace.is_done(run)) {
            let until = begun.iter().map(|(run, _)| run.end.min(stretch.from + STRETCH)).max().unwrap_or(0);
            stretch.samples = until - stretch.from;
            let length = signals * stretch.samples * L;
            begun.par_iter_mut().zip(&mut stretch.blocks).for_each(|((run, workspace), block)| {
                block.clear();
                let mut run = Run { trace: None, record: None, residuals: None, weighted: None, ..*run };
                match what {
                    Leaving::Residuals => run.residuals = Some(&mut *block),
                    Leaving::Weighted => run.weighted = Some(&mut *block),
                }
                run_block(self.set, &blocks.program, workspace, &mut run, until);
                // Shorter if all of its runs have failed.
                block.resize(length, f64::NAN);
            });
            each(&stretch);
            stretch.from = until;
        }
        let mut failed = Vec::new();
        for ((run, mut workspace), block) in begun.into_iter().zip(stretch.blocks) {
            workspace.leaving = block;
            failed.extend((0..run.candidates.len()).map(|lane| workspace.raw(lane, run.settings).failure()));
            blocks.put(workspace);
        }
        failed
    }

    /// The states of one candidate after a given past; each trace ends where its run fails.
    pub fn traces(
        &self,
        case: &Case,
        index: usize,
        population: &Population,
        settings: &Settings,
        history: History<'_>,
        Traces { from, kicks, to }: Traces<'_>,
    ) -> Result<Vec<Vec<[f64; 3]>>, EvaluateError> {
        let stream = &self.streams[index];
        let one = candidate(case, stream.longest, 0, 0, &population.parameters(0))?;
        let kicks: Vec<[T; 3]> = kicks.iter().map(|kick| kick.map(T::of)).collect();
        let (jobs, end) = ([Job { case: index, population }], to.min(stream.samples()));
        let columns = self.columns(&jobs);
        let mut all = Vec::with_capacity(from.len());
        for (part, from) in from.chunks(B).enumerate() {
            let candidates: Vec<Candidate> = from.iter().map(|&first| Candidate { first, ..one }).collect();
            let (first, last) = (from.iter().min().unwrap_or(&0), from.iter().max().unwrap_or(&0));
            // No step looks further back than a workspace remembers.
            let begin = first.saturating_sub(self.longest() + 2);
            let past: Vec<[T; 3]> = (begin..*last).map(|t| [0, 1, 2].map(|k| T::of(history[k][t]))).collect();
            let mut states = Vec::with_capacity((end - begin.min(end)) * from.len());
            let mut run = Run {
                settings,
                stream,
                jobs: &jobs,
                columns: &columns,
                candidates: &candidates,
                history: Some((begin, &past)),
                kicks: kicks.get(part * B..).unwrap_or(&[]),
                end,
                trace: Some(&mut states),
                observers: &[],
                record: None,
                residuals: None,
                weighted: None,
            };
            let mut workspace = self.small.take(self.longest());
            self.run_whole(&self.small.program, &mut workspace, &mut run);
            for (lane, from) in from.iter().enumerate() {
                let failed = workspace.raw(lane, settings).failure().map_or(end, |failure| failure.step + 1);
                let own = states.iter().skip(lane).step_by(candidates.len()).take(failed.saturating_sub(begin));
                all.push(own.skip(from - begin).copied().collect());
            }
            self.small.put(workspace);
        }
        Ok(all)
    }
}

impl<T: Real, const L: usize> Workspace<T, L> {
    fn score(&self, lane: usize, candidate: &Candidate, run: &Run<'_, T>) -> Score {
        let raw = self.raw(lane, run.settings);
        match raw.failure() {
            Some(failure) => Score::Failed(failure),
            None if run.settings.soft.is_none() && run.stream.rejects && raw.n_cut_acc + raw.n_cut_dec > 0 => {
                Score::Rejected
            }
            None => Score::Value(self.sums.score(lane, run.settings, &run.stream.norms[candidate.first])),
        }
    }

    fn raw(&self, lane: usize, settings: &Settings) -> Raw {
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
