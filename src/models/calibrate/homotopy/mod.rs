//! Calibration by derivatives: Gauss and Newton's steps from many starts, under a pull towards the measurement that fades.
//!
//! A goodness of fit is a sum of norms of residuals, so that their derivatives give both its gradient and most of its curvature. Alone,
//! such steps end in the basin that they start in. Where the simulated follower is pulled to the measured one after each step, all starts
//! find the same basin; as the pull is weakened, they follow it. Runs go on behind a collision and pay for it, because a score that ends
//! at one says nothing of the way out. Several searches that agree end the calibration.

pub mod descent;
mod objective;
mod step;

use super::search::fall_to;
use super::{CalibrateError, Calibration, OptimizerKind, Progress, Replicate, SearchSpace, StopReason};
use crate::convention::{Convention, Delay};
use crate::evaluator::{Case, EvaluateError, Pull, Score, Soft};
use crate::lanes::{Lanes, LanesPrecision};
use crate::optimize::{Descent, DescentSettings, Merit, Optimizer, Origin, SearchBox, Start, normal, stream};
use crate::rescore;
use crate::score::{Accumulation, GoodnessOfFit};
use crate::symbols::Symbol;
use descent::{Course, Surface, Walker, Watch, descend};
use nalgebra::{DMatrix, DVector};
use objective::Objective;
use rand::RngExt;
use std::ops::{ControlFlow, Range};
use std::time::Instant;

/// Random places that a search begins with.
const SCREENED: usize = 96;
/// Of these, how many go down under the pull, and how far apart they are at least, as a root mean square over the coordinates.
const STARTS: usize = 10;
const APART: f64 = 0.15;
/// Without a pull: turns, and how many go on after them.
const DIRECT: [(usize, usize); 3] = [(3, STARTS), (4, 5), (8, FINAL)];
/// Shares of the residuals that are taken back after each step, one level after the other.
const LEVELS: [f64; 5] = [0.1, 0.03, 0.01, 0.003, 0.001];
/// Turns of a level.
const TURNS: usize = 6;
/// Two places have met if their costs differ by less than the first share and their coordinates by less than [`APART`], or their costs by
/// less than the second share.
const MET: [f64; 2] = [3e-3, 1e-6];
/// Costs above this multiple of the best are given up, under a pull that is stronger than [`WEAK`] and under a weaker one.
const BEHIND: [f64; 2] = [1.5, 1.25];
const WEAK: f64 = 0.003;
/// Places that go on under a strong and under a weak pull.
const KEPT: [usize; 2] = [STARTS, 6];
/// Places that go on to the end, and how much worse than the best they may be.
const FINAL: usize = 3;
const FINAL_BEHIND: f64 = 1.05;
/// Gain of a turn below which a descent is idle: on the way, and at its end.
const ROUGH: f64 = 1e-4;
const FINE: f64 = 1e-6;
/// Softness of collisions until the end, and then of those that a place still has.
const SOFT: [[f64; 2]; 3] = [[0.1, 1.0], [0.02, 100.0], [0.004, 1e4]];
/// Two searches agree if their scores differ by no more than this share of the lower one, or of [`super::search::FLOOR`].
const AGREEMENT: f64 = 3e-4;
/// Searches that have to agree; one more for each other basin in which some ended.
const AGREEING: usize = 2;
/// Evaluations that are kept for the exact scores of the places that a search has come to when it is stopped.
const LAST: u64 = 16;
/// Turns that there should be evaluations for, lest fewer starts go down.
const SOME_TURNS: usize = 5;
/// A promise of derivatives that is not kept, as a share of the score: below it a place is an optimum, above it a polish follows.
const PROMISE: f64 = 1e-5;
/// A run as it is.
const HARD: Pull = Pull { share: 0.0, soft: None };
/// Rise of the score, as a share of it, to the places that a polish on an edge begins with; its simulations per parameter at most, and what
/// its generations are multiples of, the lanes of a small block.
const EDGE: f64 = 1e-4;
const POLISH: usize = 250;
const LANES: usize = 16;
/// Candidates per parameter that are looked at around the best, their mean rises as shares of its score, and the curvature of a
/// parameter that does nothing, as a share of the largest. Correlations need ten per parameter within the rise that ends an interval, so
/// some are far nearer than others.
const AROUND: usize = 36;
const RISES: [f64; 2] = [0.005, 0.0005];
const WIDEST: f64 = 1e-4;
/// Searches at most.
const SEARCHES: u64 = 8;

/// The evaluators of searches by derivatives, over the cases of a calibration.
pub(super) struct Ground {
    /// With delays between samples, so that the score is smooth in them.
    smooth: Lanes,
    /// As the convention has it, where that is something else.
    exact: Option<Lanes>,
}

impl Ground {
    /// `None` for another optimiser, and for Theil's coefficients, which are no norms of residuals.
    pub fn new(cases: &[Case], gof: &GoodnessOfFit, settings: &Calibration) -> Result<Option<Ground>, EvaluateError> {
        let Case { variant, convention, .. } = &cases[0];
        if settings.optimizer != OptimizerKind::Auto || gof.accumulation() == Accumulation::Theil {
            return Ok(None);
        }
        let lanes = |cases: Vec<Case>| Lanes::new(cases, *gof, LanesPrecision::F64);
        let floored = variant.perceives_late() && convention.delay == Delay::Floor;
        let between = |case: &Case| Case {
            convention: Convention { delay: Delay::Fractional, ..case.convention },
            ..case.clone()
        };
        let exact = floored.then(|| lanes(cases.to_vec())).transpose()?;
        let smooth = lanes(if floored { cases.iter().map(between).collect() } else { cases.to_vec() })?;
        Ok(Some(Ground { smooth, exact }))
    }

    fn exact(&self) -> &Lanes {
        self.exact.as_ref().unwrap_or(&self.smooth)
    }
}

/// How a search by derivatives ended.
pub(super) enum Ended {
    /// With a result.
    Found(Replicate),
    /// Searches disagree, or nothing was feasible: another optimiser has to go on; with the best so far.
    Open(Replicate),
}

/// Where a descent by the exact objective has ended.
struct Ending {
    place: Vec<f64>,
    score: f64,
    promise: f64,
    held: Vec<usize>,
}

/// One replicate under way.
struct Search<'a> {
    smooth: Objective<'a>,
    exact: Objective<'a>,
    settings: &'a Calibration,
    number: u64,
    started: Instant,
    progress: &'a (dyn Fn(Progress) -> ControlFlow<()> + Sync),
    evaluations: u64,
    stall: u64,
    /// Best place by the exact objective.
    best: Option<(Vec<f64>, f64)>,
    convergence: Vec<(u64, f64)>,
    near: Vec<(f64, Vec<f64>)>,
    stopped: Option<StopReason>,
}

impl Watch for Search<'_> {
    fn spend(&mut self, simulations: usize) -> bool {
        let stop = &self.settings.stop;
        self.stopped = self.stopped.or_else(|| {
            if (self.progress)(self.told()).is_break() {
                Some(StopReason::Interrupted)
            } else if self.evaluations + simulations as u64 + LAST > stop.max_evaluations {
                Some(StopReason::Evaluations)
            } else if self.stall >= stop.max_stall {
                Some(StopReason::Stall)
            } else {
                stop.max_time.filter(|limit| self.started.elapsed() >= *limit).map(|_| StopReason::Time)
            }
        });
        if self.stopped.is_none() {
            self.evaluations += simulations as u64;
            self.stall += 1;
        }
        self.stopped.is_none()
    }
}

/// Calibrates the variant of a ground on some of its cases.
pub(super) fn search(
    ground: &Ground,
    cases: Range<usize>,
    space: &SearchSpace,
    settings: &Calibration,
    number: u64,
    progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
) -> Result<Ended, CalibrateError> {
    let mut search = Search {
        smooth: Objective::new(&ground.smooth, cases.clone(), space),
        exact: Objective::new(ground.exact(), cases, space),
        settings,
        number,
        started: Instant::now(),
        progress,
        evaluations: 0,
        stall: 0,
        best: None,
        convergence: Vec::new(),
        near: Vec::new(),
        stopped: None,
    };
    let settled = search.run()?;
    let stop = match search.stopped {
        Some(stop) => stop,
        None if settled => StopReason::Converged,
        None => StopReason::Evaluations,
    };
    let Search { number, evaluations, convergence, near, best, .. } = search;
    let open = best.is_none() || search.stopped.is_none() && !settled;
    let (candidate, score) = match best {
        Some((place, score)) => (search.exact.candidate(&place), score),
        None => (Vec::new(), f64::INFINITY),
    };
    let replicate = Replicate { number, candidate, score, evaluations, stop, convergence, near };
    Ok(if open { Ended::Open(replicate) } else { Ended::Found(replicate) })
}

impl Search<'_> {
    fn told(&self) -> Progress {
        let best = self.best.as_ref().map(|(_, score)| *score);
        Progress { replicate: self.number, evaluations: self.evaluations, best }
    }

    fn soft(&self, level: usize, share: f64) -> Pull {
        let [least, price] = SOFT[level];
        Pull { share, soft: Some(Soft { least, price }) }
    }

    /// Searches until enough agree; true if they do.
    fn run(&mut self) -> Result<bool, CalibrateError> {
        let mut found: Vec<f64> = Vec::new();
        for round in 0..SEARCHES {
            let mut rng = stream(self.settings.seed, self.number, round, 0);
            let n = self.smooth.dimensions();
            let screened = SCREENED.min((self.settings.stop.max_evaluations / 4) as usize);
            let places: Vec<Vec<f64>> = (0..screened).map(|_| (0..n).map(|_| rng.random()).collect()).collect();
            let score = if round % 2 == 0 { self.directly(&places)? } else { self.homotopy(&places)? };
            if self.stopped.is_some() {
                return Ok(false);
            }
            found.push(score);
            let best = found.iter().copied().fold(f64::INFINITY, f64::min);
            let limit = best + AGREEMENT * best.abs().max(super::search::FLOOR);
            let agreeing = found.iter().filter(|score| **score <= limit).count();
            let mut others: Vec<f64> = found.iter().copied().filter(|score| *score > limit).collect();
            others.sort_by(f64::total_cmp);
            others.dedup_by(|a, b| *a - *b <= AGREEMENT * b.abs().max(super::search::FLOOR));
            let elsewhere = others.len();
            if best.is_finite() && agreeing >= AGREEING + elsewhere {
                self.look_around()?;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// From the best of the screened places without a pull: all that most surfaces need, and the first result of every search.
    fn directly(&mut self, places: &[Vec<f64>]) -> Result<f64, CalibrateError> {
        let pull = self.soft(0, 0.0);
        if !self.spend(places.len()) {
            return Ok(f64::INFINITY);
        }
        let costs = self.smooth.costs(places, pull)?;
        let mut starts = best_apart(places, &costs, self.affordable(), APART);
        if self.best.is_none() {
            self.score_exactly(&starts)?;
        }
        let mut walkers = Vec::new();
        for (turns, kept) in DIRECT {
            let course = Course { pull, turns, tolerance: ROUGH };
            let next = merged(descend(&self.smooth.clone(), starts, &[], course, self)?);
            if next.is_empty() {
                break;
            }
            walkers = next;
            walkers.truncate(kept);
            starts = walkers.iter().map(|walker| walker.place.clone()).collect();
        }
        self.finish(walkers, FINAL)
    }

    /// From screened places under a pull that fades.
    fn homotopy(&mut self, places: &[Vec<f64>]) -> Result<f64, CalibrateError> {
        if !self.spend(places.len()) {
            return Ok(f64::INFINITY);
        }
        let costs = self.smooth.costs(places, self.soft(0, LEVELS[0]))?;
        let mut starts = best_apart(places, &costs, self.affordable(), APART);
        for share in LEVELS {
            let course = Course { pull: self.soft(0, share), turns: TURNS, tolerance: ROUGH };
            let walkers = merged(descend(&self.smooth.clone(), starts, &[], course, self)?);
            let weak = usize::from(share <= WEAK);
            let Some(best) = walkers.first().map(|walker| walker.cost) else { return Ok(f64::INFINITY) };
            let near = walkers.into_iter().filter(|walker| walker.cost <= best * BEHIND[weak]);
            starts = near.take(KEPT[weak]).map(|walker| walker.place).collect();
        }
        let course = Course { pull: self.soft(0, 0.0), turns: 10, tolerance: ROUGH };
        let walkers = descend(&self.smooth.clone(), starts, &[], course, self)?;
        self.finish(walkers, FINAL)
    }

    /// To the end from the best places: collisions become hard, delays whole where they are. The lowest exact score.
    fn finish(&mut self, walkers: Vec<Walker>, most: usize) -> Result<f64, CalibrateError> {
        let walkers = merged(walkers);
        if self.stopped.is_some() {
            self.score_exactly(&walkers.into_iter().map(|walker| walker.place).collect::<Vec<_>>())?;
            return Ok(f64::INFINITY);
        }
        let Some(best) = walkers.first().map(|walker| walker.cost) else { return Ok(f64::INFINITY) };
        let near = walkers.into_iter().filter(|walker| walker.cost <= best * FINAL_BEHIND);
        let mut places: Vec<Vec<f64>> = near.take(most).map(|walker| walker.place).collect();
        for (level, turns) in [(0, 15), (1, 8), (2, 8)] {
            let pull = self.soft(level, 0.0);
            if level > 0 && !self.pays(&places)?.contains(&true) {
                break;
            }
            let course = Course { pull, turns, tolerance: FINE };
            places = descend(&self.smooth.clone(), places, &[], course, self)?.into_iter().map(|w| w.place).collect();
        }
        if self.stopped.is_some() {
            self.score_exactly(&places)?;
            return Ok(f64::INFINITY);
        }
        let mut best: Option<Ending> = None;
        for place in places {
            let whole = self.whole_delays(&place);
            let held: Vec<usize> = whole.iter().map(|(at, _)| *at).collect();
            let with = |delay: f64| {
                let mut place = place.clone();
                held.iter().for_each(|at| place[*at] = delay);
                place
            };
            let delays = whole.map_or_else(|| vec![0.0], |(_, delays)| delays);
            for place in delays.into_iter().map(with) {
                let ending = self.exactly(place, held.clone())?;
                if best.as_ref().is_none_or(|best| ending.score < best.score) {
                    best = Some(ending);
                }
            }
        }
        let Some(mut best) = best else { return Ok(f64::INFINITY) };
        let is_optimum = best.promise <= PROMISE * best.score.max(super::search::FLOOR);
        if !is_optimum {
            (best.place, best.score) = self.polished((best.place, best.score), &best.held)?;
        }
        if best.score.is_finite() {
            self.keep(best.place, best.score);
        }
        self.compare_with_target()?;
        Ok(best.score)
    }

    /// Down by the exact objective, `held` coordinates apart.
    fn exactly(&mut self, place: Vec<f64>, held: Vec<usize>) -> Result<Ending, CalibrateError> {
        let objective = self.exact.clone();
        let mut ending = Ending { place, score: f64::INFINITY, promise: f64::INFINITY, held };
        if !self.spend(1) {
            return Ok(ending);
        }
        ending.score = objective.costs(std::slice::from_ref(&ending.place), HARD)?[0];
        if ending.score.is_finite() {
            let course = Course { pull: HARD, turns: 10, tolerance: FINE };
            let walkers = descend(&objective, vec![ending.place.clone()], &ending.held, course, self)?;
            if let Some(walker) = walkers.into_iter().find(|walker| walker.cost.is_finite()) {
                (ending.place, ending.score, ending.promise) = (walker.place, walker.cost, walker.promise);
            }
        }
        Ok(ending)
    }

    /// By scores alone, from a place that need not be feasible.
    fn polished(&mut self, found: (Vec<f64>, f64), held: &[usize]) -> Result<(Vec<f64>, f64), CalibrateError> {
        let moved: Vec<usize> = (0..found.0.len()).filter(|i| !held.contains(i)).collect();
        let n = moved.len();
        if n == 0 {
            return Ok(found);
        }
        let rise = EDGE * if found.1.is_finite() { found.1 } else { 1.0 };
        let points = self.around(&found.0, held, [rise; 2], 4 * n)?;
        if points.is_empty() {
            return Ok(found);
        }
        let take = |place: &Vec<f64>| moved.iter().map(|i| place[*i]).collect::<Vec<f64>>();
        let settings = DescentSettings {
            population: (2 * DescentSettings::population_for(n)).next_multiple_of(LANES),
            evaluations: (POLISH * n) as u64,
            tolerance: FINE,
            floor: super::search::FLOOR,
        };
        let start = Start::Population { middle: take(&found.0), points: points.iter().map(take).collect() };
        let unit = SearchBox { lower: vec![0.0; n], upper: vec![1.0; n] };
        let mut descent = Descent::new(unit, start, settings, Origin::new(self.settings.seed, self.number));
        let whole = |point: &Vec<f64>| {
            let mut place = found.0.clone();
            moved.iter().zip(point).for_each(|(i, x)| place[*i] = *x);
            place
        };
        while descent.ended().is_none() {
            let points = descent.ask();
            if points.is_empty() || !self.spend(points.len()) {
                break;
            }
            let places: Vec<Vec<f64>> = points.iter().map(whole).collect();
            let scores = self.exact.scores(&places, HARD)?;
            let merits: Vec<Merit> = scores.iter().map(|(score, _)| super::merit(score)).collect();
            descent.tell(&merits);
        }
        Ok(match descent.best() {
            Some(member) => match member.merit {
                Merit::Feasible(score) if score < found.1 => (whole(&member.point), score),
                _ => found,
            },
            None => found,
        })
    }

    /// Ends the search if the best score, by the reference, is good enough.
    fn compare_with_target(&mut self) -> Result<(), CalibrateError> {
        let Some(((place, score), target)) = self.best.as_ref().zip(self.settings.stop.target) else { return Ok(()) };
        if *score <= target && self.stopped.is_none() {
            let parameters = self.exact.parameters(place);
            let score = rescore::score(self.exact.cases(), self.exact.gof(), &parameters)?;
            if matches!(score, Score::Value(score) if score <= target) {
                self.stopped = Some(StopReason::Target);
            }
        }
        Ok(())
    }

    /// Starts that what is left of the evaluations brings some turns down.
    fn affordable(&self) -> usize {
        let left = self.settings.stop.max_evaluations.saturating_sub(self.evaluations) as usize;
        (left / (SOME_TURNS * descent::turn(self.smooth.dimensions()))).clamp(1, STARTS)
    }

    /// The exact scores of some places, so that a search that is stopped has a result.
    fn score_exactly(&mut self, places: &[Vec<f64>]) -> Result<(), CalibrateError> {
        let places = &places[..places.len().min(LAST as usize / 2)];
        self.evaluations += places.len() as u64;
        let costs = self.exact.costs(places, HARD)?;
        for (place, cost) in places.iter().zip(costs).filter(|(_, cost)| cost.is_finite()) {
            self.keep(place.clone(), cost);
        }
        self.compare_with_target()
    }

    /// Which places pay for something, in runs without a pull.
    fn pays(&mut self, places: &[Vec<f64>]) -> Result<Vec<bool>, CalibrateError> {
        if !self.spend(places.len()) {
            return Ok(vec![false; places.len()]);
        }
        let scores = self.smooth.scores(places, self.soft(0, 0.0))?;
        Ok(scores.iter().map(|(_, shortfall)| *shortfall > 0.0).collect())
    }

    /// Where the convention floors delays: the coordinate of the delay, and its values at the two whole numbers of samples around it.
    fn whole_delays(&self, place: &[f64]) -> Option<(usize, Vec<f64>)> {
        let case = &self.exact.cases()[0];
        if case.convention.delay != Delay::Floor || !case.variant.perceives_late() {
            return None;
        }
        let symbols = case.variant.parameters();
        let candidate = self.exact.candidate(place);
        let delays = [Some(Symbol::tau_p), case.variant.extensions.delay()];
        let (at, own, parameter) = delays.into_iter().flatten().find_map(|symbol| {
            let parameter = symbols.iter().position(|known| *known == symbol)?;
            let (at, _) = self.exact.coordinate(parameter, candidate[parameter])?;
            Some((at, candidate[parameter], parameter))
        })?;
        let whole: f64 = delays
            .into_iter()
            .flatten()
            .filter_map(|s| symbols.iter().position(|k| *k == s))
            .map(|p| candidate[p])
            .sum();
        // Behind the whole number, so that no rounding puts it before.
        let of = |steps: f64| {
            self.exact.coordinate(parameter, steps * case.dt + 1e-6 - (whole - own)).map(|(_, u)| u.clamp(0.0, 1.0))
        };
        let steps = (whole / case.dt).floor();
        Some((at, [steps, steps + 1.0].into_iter().filter_map(of).collect()))
    }

    /// Candidates around the best one, as far away as costs a little: they show which parameters make up for each other.
    fn look_around(&mut self) -> Result<(), CalibrateError> {
        let Some((best, score)) = self.best.clone() else { return Ok(()) };
        let rises = RISES.map(|rise| rise * score.max(super::search::FLOOR));
        let places = self.around(&best, &[], rises, AROUND * best.len())?;
        if !self.spend(places.len()) {
            return Ok(());
        }
        let costs = self.exact.costs(&places, HARD)?;
        for (place, cost) in places.into_iter().zip(costs) {
            if cost <= score + super::search::NEAR * score.abs() {
                self.keep(place, cost);
            }
        }
        Ok(())
    }

    /// Places around another one, at which costs rise in the mean by one of these and the other by turns.
    fn around(
        &mut self,
        middle: &[f64],
        held: &[usize],
        rises: [f64; 2],
        count: usize,
    ) -> Result<Vec<Vec<f64>>, CalibrateError> {
        let n = middle.len();
        if !self.spend(n + 1 - held.len()) {
            return Ok(Vec::new());
        }
        let curvature = self.smooth.slopes(&[&middle.to_vec()], held, self.soft(0, 0.0))?.remove(0).majorant;
        let largest = curvature.diagonal().max();
        let floor = DMatrix::from_diagonal_element(n, n, (WIDEST * largest).max(f64::MIN_POSITIVE.sqrt()));
        let Some(root) = (curvature + floor).cholesky() else { return Ok(Vec::new()) };
        let mut rng = stream(self.settings.seed, self.number, u64::MAX, self.evaluations);
        let place = |k: usize| {
            let size = (2.0 * rises[k % rises.len()] / n as f64).sqrt();
            let draw = DVector::from_fn(n, |_, _| size * normal(&mut rng));
            let step = root.l().transpose().solve_upper_triangular(&draw).unwrap_or(draw);
            let moved = |(i, x): (usize, &f64)| if held.contains(&i) { *x } else { (x + step[i]).clamp(0.0, 1.0) };
            middle.iter().enumerate().map(moved).collect()
        };
        Ok((0..count).map(place).collect())
    }

    fn keep(&mut self, place: Vec<f64>, score: f64) {
        self.near.push((score, self.exact.candidate(&place)));
        if self.best.as_ref().is_none_or(|(_, best)| score < *best) {
            self.stall = 0;
            self.best = Some((place, score));
            fall_to(&mut self.convergence, self.evaluations, score);
        }
    }
}

/// The best places that are so far apart, at most so many.
fn best_apart(places: &[Vec<f64>], costs: &[f64], most: usize, apart: f64) -> Vec<Vec<f64>> {
    let mut order: Vec<usize> = (0..places.len()).filter(|&i| costs[i].is_finite()).collect();
    order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    let mut picked: Vec<Vec<f64>> = Vec::new();
    for i in order {
        let distance = |other: &Vec<f64>| {
            let squares: f64 = places[i].iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum();
            (squares / places[i].len() as f64).sqrt()
        };
        if picked.len() < most && picked.iter().all(|other| distance(other) > apart) {
            picked.push(places[i].clone());
        }
    }
    picked
}

/// The best first; of those that have met, the best.
fn merged(mut walkers: Vec<Walker>) -> Vec<Walker> {
    walkers.retain(|walker| walker.cost.is_finite());
    walkers.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut kept: Vec<Walker> = Vec::new();
    for walker in walkers {
        let met = |other: &Walker| {
            let behind = walker.cost - other.cost;
            let farthest = walker.place.iter().zip(&other.place).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            behind <= MET[0] * other.cost && farthest < APART || behind <= MET[1] * other.cost
        };
        if !kept.iter().any(met) {
            kept.push(walker);
        }
    }
    kept
}
