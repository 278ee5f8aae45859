//! Replicates under way: each a search of its own, several evaluated together.

use super::exact::Exact;
use super::settled::ASKED;
use super::space::SearchSpace;
use super::{CalibrateError, Calibration, OptimizerKind, Progress, Replicate, Stop, StopReason, Tally};
use crate::evaluator::{BufferSet, EvaluateError, Evaluator, Job, Population, Score, shares};
use crate::lanes::LanesPrecision;
use crate::optimize::{Auto, AutoSettings, Cmaes, CmaesSettings, Ended, Ga, GaSettings, Lshade, LshadeSettings};
use crate::optimize::{Member, Merit, Optimizer, Origin};
use crate::rescore;
use rayon::prelude::*;
use std::ops::{ControlFlow, Range};
use std::sync::LazyLock;
use std::time::Instant;

/// State of the search. Raise it whenever the same seed gives another result: another score, other parameters or another number of
/// evaluations, for any reason (optimisers, search space, stopping rules, evaluators). Ids of tasks and journals contain it, so that
/// results of two states never mix. Versions before 2 did not record it.
pub const SEARCH_REVISION: u32 = 16;

/// Program, version and state of its search, `leadlag 0.1.0+search16`: with the same one a seed gives the same result.
pub static PROGRAM: LazyLock<String> =
    LazyLock::new(|| format!("leadlag {}+search{SEARCH_REVISION}", env!("CARGO_PKG_VERSION")));

/// One replicate.
pub(super) struct Search<'a> {
    /// Its place among the tasks.
    pub(super) task: usize,
    pub(super) number: u64,
    pub(super) space: &'a SearchSpace,
    /// The cases of the evaluator that its candidates are simulated on.
    pub(super) cases: Range<usize>,
    /// True if the optimiser sees logarithms of parameters that span decades.
    ratios: bool,
    free: Vec<usize>,
    stop: Stop,
    started: Instant,
    optimizer: Box<dyn Optimizer + Send>,
    population: Population,
    /// True if the generation under way is scored by the exact evaluator.
    exact: bool,
    /// Evaluations of a search before it.
    pub(super) earlier: u64,
    evaluations: u64,
    stall: u64,
    /// The lowest score that the optimiser last kept: of its best, or of its rival.
    latest: Option<f64>,
    /// Scores of the best and of its rival at the last comparison with the target.
    compared: [Option<f64>; 2],
    tally: Tally,
    best: Option<(Vec<f64>, f64)>,
    convergence: Vec<(u64, f64)>,
    near: Vec<(f64, Vec<f64>)>,
    ended: Option<StopReason>,
}

impl<'a> Search<'a> {
    pub(super) fn new(space: &'a SearchSpace, cases: Range<usize>, settings: &Calibration, number: u64) -> Search<'a> {
        let free = space.free();
        let optimizer = optimizer(space, settings, number);
        Search {
            task: 0,
            number,
            space,
            cases,
            ratios: ratios(settings.optimizer),
            free,
            stop: settings.stop,
            started: Instant::now(),
            optimizer,
            population: Population::new(&space.symbols),
            exact: false,
            earlier: 0,
            evaluations: 0,
            stall: 0,
            latest: None,
            compared: [None; 2],
            tally: Tally::default(),
            best: None,
            convergence: Vec::new(),
            near: Vec::new(),
            ended: None,
        }
    }

    /// Fills the population with the next generation, or ends the search. `two_kinds`: exact scores come from elsewhere.
    fn ask(&mut self, two_kinds: bool) {
        self.exact = two_kinds && self.optimizer.wants_exact();
        let points = self.optimizer.ask();
        self.population.clear();
        if self.evaluations + points.len() as u64 > self.stop.max_evaluations && self.evaluations > 0 {
            self.ended = Some(StopReason::Evaluations);
            return;
        }
        points.iter().for_each(|point| self.population.push(&self.space.complete(&self.free, point, self.ratios)));
    }

    /// Takes the scores of the generation.
    fn take(&mut self, scores: &[Score]) {
        self.evaluations += scores.len() as u64;
        self.optimizer.tell(&scores.iter().map(merit).collect::<Vec<_>>());
        self.tally.add(scores);
        self.remember(scores);
        if let Some((point, score)) = self.optimizer.best().and_then(|member| Some((&member.point, value(member)?))) {
            self.best = Some((self.space.complete(&self.free, point, self.ratios), score));
            if self.convergence.last().is_none_or(|(_, last)| score != *last) {
                // The first exact score of the best may be worse by a rounding error: then the curve had fallen too far.
                fall_to(&mut self.convergence, self.evaluations, score);
            }
        }
    }

    /// Decides whether the search continues.
    fn decide(
        &mut self,
        evaluator: &dyn Evaluator,
        progress: &mut dyn FnMut(usize, Progress) -> ControlFlow<()>,
    ) -> Result<(), EvaluateError> {
        let best = self.optimizer.best().and_then(value);
        let held_out = self.optimizer.rival().and_then(value).or(best);
        let gain = held_out.is_some_and(|score| self.latest.is_none_or(|latest| score < latest));
        self.stall = if gain { 0 } else { self.stall + 1 };
        self.latest = held_out;
        let evaluations = self.earlier + self.evaluations;
        let told = progress(self.task, Progress { replicate: self.number, evaluations, best });
        self.ended = if told.is_break() {
            Some(StopReason::Interrupted)
        } else if self.free.is_empty() {
            Some(StopReason::NothingToSearch)
        } else if self.is_on_target(evaluator)? {
            Some(StopReason::Target)
        } else if let Some(ended) = self.optimizer.ended() {
            Some(match ended {
                Ended::Converged => StopReason::Converged,
                Ended::Spent => StopReason::Evaluations,
            })
        } else if self.stall >= self.stop.max_stall {
            Some(StopReason::Stall)
        } else if self.stop.max_time.is_some_and(|limit| self.started.elapsed() >= limit) {
            Some(StopReason::Time)
        } else {
            None
        };
        Ok(())
    }

    /// True if the best candidate, or its rival, has reached the target not only by the score that the optimiser received, but also by
    /// the reported one of the reference. Each is checked once.
    fn is_on_target(&mut self, evaluator: &dyn Evaluator) -> Result<bool, EvaluateError> {
        let Some(target) = self.stop.target else { return Ok(false) };
        for (k, member) in [self.optimizer.best(), self.optimizer.rival()].into_iter().enumerate() {
            let Some((member, score)) = member.and_then(|member| Some((member, value(member)?))) else { continue };
            if score > target || self.compared[k].replace(score) == Some(score) {
                continue;
            }
            let candidate = self.space.complete(&self.free, &member.point, self.ratios);
            let parameters = self.space.parameters(&candidate);
            match rescore::score(&evaluator.cases()[self.cases.clone()], evaluator.gof(), &parameters)? {
                Score::Value(score) if score <= target => return Ok(true),
                _ => {}
            }
        }
        Ok(false)
    }

    /// Keeps the best candidates.
    fn remember(&mut self, scores: &[Score]) {
        for (i, score) in scores.iter().enumerate() {
            if let Merit::Feasible(value) = merit(score) {
                self.near.push((value, self.population.values(i).to_vec()));
            }
        }
        if self.near.len() > 2 * ASKED {
            self.near.sort_by(|a, b| a.0.total_cmp(&b.0));
            self.near.truncate(ASKED);
        }
    }

    /// Result of a search without a feasible candidate: the one that came furthest.
    pub(super) fn furthest(&self) -> Option<Replicate> {
        let member = self.optimizer.best()?;
        Some(Replicate {
            number: self.number,
            candidate: self.space.complete(&self.free, &member.point, self.ratios),
            score: f64::INFINITY,
            evaluations: self.evaluations,
            stop: StopReason::Infeasible,
            convergence: Vec::new(),
            near: Vec::new(),
        })
    }

    /// The best candidate, and its rival if the search ended between the two: a candidate that may be better.
    pub(super) fn finish(self) -> Result<(Replicate, Option<Vec<f64>>), CalibrateError> {
        let rival = self.optimizer.rival().map(|m| self.space.complete(&self.free, &m.point, self.ratios));
        let Search { number, evaluations, convergence, tally, near, .. } = self;
        let stop = self.ended.expect("a search is finished when it has ended");
        match self.best {
            Some((candidate, score)) => {
                Ok((Replicate { number, candidate, score, evaluations, stop, convergence, near }, rival))
            }
            None if stop == StopReason::Interrupted => Err(CalibrateError::Interrupted),
            None => Err(CalibrateError::Infeasible { replicate: number, evaluations, tally }),
        }
    }
}

/// The value of a feasible member.
fn value(member: &Member) -> Option<f64> {
    match member.merit {
        Merit::Feasible(value) => Some(value),
        Merit::Infeasible { .. } => None,
    }
}

/// Appends the present best score to a curve of best scores, which must not have been lower before.
pub(super) fn fall_to(curve: &mut Vec<(u64, f64)>, evaluations: u64, score: f64) {
    while curve.last().is_some_and(|(_, last)| *last <= score) {
        curve.pop();
    }
    curve.push((evaluations, score));
}

/// True if parameters that span decades are searched by their logarithms. The paper's algorithm keeps the paper's scale.
fn ratios(optimizer: OptimizerKind) -> bool {
    optimizer != OptimizerKind::Ga
}

/// The optimiser of a replicate.
fn optimizer(space: &SearchSpace, settings: &Calibration, number: u64) -> Box<dyn Optimizer + Send> {
    let (search_box, evaluations) = (space.search_box(ratios(settings.optimizer)), settings.stop.max_evaluations);
    let (dimensions, origin) = (search_box.dimensions(), Origin::new(settings.seed, number));
    // With every parameter fixed there is one candidate, to be scored once.
    if dimensions == 0 {
        let ga = GaSettings { population_size: 1, ..GaSettings::default() };
        return Box::new(Ga::new(search_box, ga, settings.seed, number));
    }
    match settings.optimizer {
        OptimizerKind::Auto => Box::new(Auto::new(
            search_box,
            AutoSettings { floor: FLOOR, ..AutoSettings::new(dimensions, evaluations) },
            origin,
        )),
        OptimizerKind::Ga => {
            let own = GaSettings::default();
            let ga = GaSettings { population_size: settings.population.unwrap_or(own.population_size), ..own };
            Box::new(Ga::new(search_box, ga, settings.seed, number))
        }
        OptimizerKind::Lshade => {
            let own = LshadeSettings::new(dimensions, evaluations);
            let first_population = settings.population.unwrap_or(own.first_population);
            let lshade = LshadeSettings { first_population, tolerance: RESOLUTION, floor: FLOOR, ..own };
            Box::new(Lshade::new(search_box, lshade, origin))
        }
        OptimizerKind::Cmaes => {
            let cmaes = CmaesSettings { evaluations, tolerance: RESOLUTION, floor: FLOOR };
            Box::new(Cmaes::new(search_box, cmaes, origin))
        }
    }
}

/// Share of the best score at which `lshade` and the descents of `cmaes` end. It lies below the rounding of f32 scores, some 1e-6
/// in a run of ten thousand steps: they end once their candidates are nearly one, not where rounding begins to hide the remainder.
const RESOLUTION: f64 = 1e-7;

/// Tolerances are shares of this where the best score is smaller. NRMSE(s,v,a) of measured data is ten times as large and more, the
/// smallest measures of speeds alone (u-v) are about as large; on a drive that the variant itself made scores approach 0, a share
/// of which is never reached. Rounds then agree within 1e-6, the resolution of such a score in f32.
pub(super) const FLOOR: f64 = 0.01;

/// Searches whose generations are evaluated in one go.
pub(super) struct Group<'a> {
    pub(super) searches: Vec<Search<'a>>,
    /// Scores of all jobs as the evaluator gives them.
    by_job: Vec<Score>,
    /// The same for searches whose generation is scored exactly.
    exact_by_job: Vec<Score>,
}

impl<'a> Group<'a> {
    pub(super) fn new(searches: Vec<Search<'a>>) -> Group<'a> {
        Group { searches, by_job: Vec::new(), exact_by_job: Vec::new() }
    }

    fn is_running(&self) -> bool {
        self.searches.iter().any(|search| search.ended.is_none())
    }

    /// Breeds the next generation of every search that continues, and starts its simulation.
    fn submit(
        &mut self,
        evaluator: &mut dyn Evaluator,
        exact: &mut Exact,
        set: BufferSet,
    ) -> Result<(), EvaluateError> {
        let two_kinds = evaluator.precision() != LanesPrecision::F64.into_str();
        let going = self.searches.par_iter_mut().filter(|search| search.ended.is_none());
        going.for_each(|search| search.ask(two_kinds));
        let (rough, exactly): (Vec<&Search>, Vec<&Search>) =
            self.searches.iter().filter(|search| search.ended.is_none()).partition(|search| !search.exact);
        let wanted = |searches: &[&Search]| searches.iter().map(|s| s.cases.len() * s.population.len()).sum();
        self.by_job.clear();
        self.by_job.resize(wanted(&rough), Score::Rejected);
        self.exact_by_job.clear();
        self.exact_by_job.resize(wanted(&exactly), Score::Rejected);
        if !rough.is_empty() {
            evaluator.submit(set, &jobs(&rough))?;
        }
        if !exactly.is_empty() {
            exact.evaluate(evaluator, &jobs(&exactly), &mut self.exact_by_job)?;
        }
        Ok(())
    }

    /// Waits for the generation and hands each search its scores.
    fn collect(
        &mut self,
        evaluator: &mut dyn Evaluator,
        set: BufferSet,
        progress: &mut dyn FnMut(usize, Progress) -> ControlFlow<()>,
    ) -> Result<(), EvaluateError> {
        if !self.by_job.is_empty() {
            evaluator.collect(set, &mut self.by_job)?;
        }
        let shares = shares(evaluator.cases(), evaluator.gof());
        // The remaining approximate and exact scores.
        let mut rest = [self.by_job.as_slice(), &self.exact_by_job];
        let mut told = Vec::new();
        for search in self.searches.iter_mut().filter(|search| search.ended.is_none()) {
            let rest = &mut rest[usize::from(search.exact)];
            let (own, others) = rest.split_at(search.cases.len() * search.population.len());
            *rest = others;
            told.push((search, own));
        }
        told.par_iter_mut().for_each(|(search, own)| match search.cases.len() {
            1 => search.take(own),
            _ => {
                let (candidates, cases) = (search.population.len(), search.cases.clone());
                let of = |i: usize| cases.clone().enumerate().map(move |(k, case)| (k * candidates + i, case));
                let joint = |i| Score::joint(of(i).map(|(at, case)| (own[at], shares[case])));
                search.take(&(0..candidates).map(joint).collect::<Vec<_>>());
            }
        });
        told.into_iter().try_for_each(|(search, _)| search.decide(evaluator, progress))?;
        // Searches that received scores before the one at which the caller stopped them all.
        if self.is_interrupted() {
            self.interrupt();
        }
        Ok(())
    }

    /// True if the caller has stopped one of the searches, and so all.
    fn is_interrupted(&self) -> bool {
        self.searches.iter().any(|search| search.ended == Some(StopReason::Interrupted))
    }

    fn interrupt(&mut self) {
        let running = self.searches.iter_mut().filter(|search| search.ended.is_none());
        running.for_each(|search| search.ended = Some(StopReason::Interrupted));
    }
}

/// Advances groups until none runs: while the device simulates the generations of one, the host breeds the other's. At most two.
pub(super) fn advance(
    groups: &mut [Group<'_>],
    evaluator: &mut dyn Evaluator,
    progress: &mut dyn FnMut(usize, Progress) -> ControlFlow<()>,
) -> Result<(), EvaluateError> {
    let mut exact = Exact::default();
    if !evaluator.overlaps() {
        while groups.iter().any(Group::is_running) {
            for group in groups.iter_mut().filter(|group| group.is_running()) {
                group.submit(evaluator, &mut exact, BufferSet::A)?;
                // One that ran out of simulations has nothing to collect.
                if group.is_running() {
                    group.collect(evaluator, BufferSet::A, progress)?;
                }
                if group.is_interrupted() {
                    groups.iter_mut().for_each(Group::interrupt);
                    return Ok(());
                }
            }
        }
        return Ok(());
    }
    let sets = [BufferSet::A, BufferSet::B];
    for (group, set) in groups.iter_mut().zip(sets) {
        group.submit(evaluator, &mut exact, set)?;
    }
    while groups.iter().any(Group::is_running) {
        for (group, set) in groups.iter_mut().zip(sets).filter(|(group, _)| group.is_running()) {
            group.collect(evaluator, set, progress)?;
            group.submit(evaluator, &mut exact, set)?;
        }
    }
    Ok(())
}

/// Every search on each of its cases.
fn jobs<'p>(searches: &[&'p Search<'_>]) -> Vec<Job<'p>> {
    let of = |search: &&'p Search<'_>| {
        let population = &search.population;
        search.cases.clone().map(move |case| Job { case, population })
    };
    searches.iter().flat_map(of).collect()
}

/// A score as an optimiser sees it. A rejected candidate survived the whole run, but is infeasible.
#[must_use]
pub fn merit(score: &Score) -> Merit {
    match score {
        Score::Value(value) if value.is_finite() => Merit::Feasible(*value),
        Score::Value(_) | Score::Rejected => Merit::Infeasible { survived: usize::MAX },
        Score::Failed(failure) => Merit::Infeasible { survived: failure.step },
    }
}
