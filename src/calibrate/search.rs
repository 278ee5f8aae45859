//! Replicates under way: each a search of its own, several evaluated together.

use super::space::SearchSpace;
use super::{CalibrateError, Calibration, OptimizerKind, Progress, Replicate, Stop, StopReason, Tally};
use crate::evaluator::{BufferSet, EvaluateError, Evaluator, Job, Population, Score};
use crate::optimize::{Ga, GaSettings, Merit, Optimizer};
use std::ops::ControlFlow;
use std::time::Instant;

/// One replicate.
pub(super) struct Search<'a> {
    pub(super) number: u64,
    space: &'a SearchSpace,
    free: Vec<usize>,
    stop: Stop,
    started: Instant,
    optimizer: Box<dyn Optimizer>,
    population: Population,
    evaluations: u64,
    stall: u64,
    tally: Tally,
    best: Option<(Vec<f64>, f64)>,
    convergence: Vec<(u64, f64)>,
    ended: Option<StopReason>,
}

impl<'a> Search<'a> {
    pub(super) fn new(space: &'a SearchSpace, settings: &Calibration, number: u64) -> Search<'a> {
        let free = space.free();
        // With every parameter fixed there is one candidate, to be scored once.
        let population_size = if free.is_empty() { 1 } else { GaSettings::default().population_size };
        let optimizer: Box<dyn Optimizer> = match settings.optimizer {
            OptimizerKind::Auto | OptimizerKind::Ga => {
                let ga = GaSettings { population_size, ..GaSettings::default() };
                Box::new(Ga::new(space.search_box(), ga, settings.seed, number))
            }
        };
        Search {
            number,
            space,
            free,
            stop: settings.stop,
            started: Instant::now(),
            optimizer,
            population: Population::new(&space.symbols),
            evaluations: 0,
            stall: 0,
            tally: Tally::default(),
            best: None,
            convergence: Vec::new(),
            ended: None,
        }
    }

    /// Fills the population with the next generation, or ends the search.
    fn ask(&mut self) {
        let points = self.optimizer.ask();
        self.population.clear();
        if self.evaluations + points.len() as u64 > self.stop.max_evaluations && self.evaluations > 0 {
            self.ended = Some(StopReason::Evaluations);
            return;
        }
        points.iter().for_each(|point| self.population.push(&self.space.complete(&self.free, point)));
    }

    /// Takes the scores of the generation.
    fn tell(&mut self, scores: &[Score], progress: &mut dyn FnMut(Progress) -> ControlFlow<()>) {
        self.evaluations += scores.len() as u64;
        self.optimizer.tell(&scores.iter().map(merit).collect::<Vec<_>>());
        self.tally.add(scores);
        self.stall += 1;
        if let Some(member) = self.optimizer.best()
            && let Merit::Feasible(score) = member.merit
            && self.best.as_ref().is_none_or(|(_, best)| score < *best)
        {
            self.best = Some((self.space.complete(&self.free, &member.point), score));
            self.convergence.push((self.evaluations, score));
            self.stall = 0;
        }
        let best = self.best.as_ref().map(|(_, score)| *score);
        let told = progress(Progress { replicate: self.number, evaluations: self.evaluations, best });
        self.ended = if told.is_break() {
            Some(StopReason::Interrupted)
        } else if self.free.is_empty() {
            Some(StopReason::NothingToSearch)
        } else if self.stop.target.is_some_and(|target| best.is_some_and(|score| score <= target)) {
            Some(StopReason::Target)
        } else if self.stall >= self.stop.max_stall {
            Some(StopReason::Stall)
        } else if self.stop.max_time.is_some_and(|limit| self.started.elapsed() >= limit) {
            Some(StopReason::Time)
        } else {
            None
        };
    }

    pub(super) fn finish(self) -> Result<Replicate, CalibrateError> {
        let Search { number, evaluations, convergence, tally, .. } = self;
        let stop = self.ended.expect("a search is finished when it has ended");
        match self.best {
            Some((candidate, score)) => Ok(Replicate { number, candidate, score, evaluations, stop, convergence }),
            None if stop == StopReason::Interrupted => Err(CalibrateError::Interrupted),
            None => Err(CalibrateError::Infeasible { replicate: number, evaluations, tally }),
        }
    }
}

/// Searches whose generations are evaluated in one go.
pub(super) struct Group<'a> {
    pub(super) searches: Vec<Search<'a>>,
    /// Scores of all jobs as the evaluator gives them, and of the candidates of one search.
    by_job: Vec<Score>,
    scores: Vec<Score>,
}

impl<'a> Group<'a> {
    pub(super) fn new(searches: Vec<Search<'a>>) -> Group<'a> {
        Group { searches, by_job: Vec::new(), scores: Vec::new() }
    }

    pub(super) fn is_running(&self) -> bool {
        self.searches.iter().any(|search| search.ended.is_none())
    }

    /// Breeds the next generation of every search that goes on, and starts its simulation.
    pub(super) fn submit(&mut self, evaluator: &mut dyn Evaluator, set: BufferSet) -> Result<(), EvaluateError> {
        self.searches.iter_mut().filter(|search| search.ended.is_none()).for_each(Search::ask);
        if !self.is_running() {
            return Ok(());
        }
        let cases = evaluator.cases().len();
        let running = self.searches.iter().filter(|search| search.ended.is_none());
        let jobs: Vec<Job> =
            running.flat_map(|search| (0..cases).map(|case| Job { case, population: &search.population })).collect();
        self.by_job.clear();
        self.by_job.resize(Job::candidates(&jobs), Score::Rejected);
        evaluator.submit(set, &jobs)
    }

    /// Waits for the generation and hands each search its scores.
    pub(super) fn collect(
        &mut self,
        evaluator: &mut dyn Evaluator,
        set: BufferSet,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<(), EvaluateError> {
        evaluator.collect(set, &mut self.by_job)?;
        let samples: Vec<usize> = evaluator.cases().iter().map(|case| case.s.len()).collect();
        let mut first = 0;
        for search in self.searches.iter_mut().filter(|search| search.ended.is_none()) {
            let candidates = search.population.len();
            let of_case = |case: usize, i: usize| (self.by_job[first + case * candidates + i], samples[case]);
            self.scores.clear();
            self.scores.extend((0..candidates).map(|i| match samples.len() {
                1 => of_case(0, i).0,
                cases => Score::joint((0..cases).map(|case| of_case(case, i))),
            }));
            first += candidates * samples.len();
            search.tell(&self.scores, progress);
        }
        Ok(())
    }
}

/// A score as the optimiser sees it. A rejected candidate survived the whole run, but is infeasible.
fn merit(score: &Score) -> Merit {
    match score {
        Score::Value(value) if value.is_finite() => Merit::Feasible(*value),
        Score::Value(_) | Score::Rejected => Merit::Infeasible { survived: usize::MAX },
        Score::Failed(failure) => Merit::Infeasible { survived: failure.step },
    }
}
