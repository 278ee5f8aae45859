//! From a basin to its lowest exact score.

use super::descent::{Course, Shared, Walker, Watch, descend_on};
use super::record::{LAST, Record};
use super::{FLOOR, Search};
use crate::calibrate::{CalibrateError, StopReason, merit};
use crate::convention::Delay;
use crate::evaluator::{Pull, Score, Soft};
use crate::optimize::{Descent, DescentSettings, Merit, Optimizer, Origin, SearchBox, Start, normal, stream};
use crate::rescore;
use crate::symbols::Symbol;
use nalgebra::{DMatrix, DVector};

/// Largest ratio of the cost of a point to the best one for the point to continue to the end.
const BEHIND: f64 = 1.05;
/// A point whose cost lies below that of a basin by more than this share has not met it.
const AHEAD: f64 = 3e-4;
/// Softness of collisions on the way, and then of those that remain. An optimum often lies at a collision. The price is low at first, so that
/// the penalty balances the score well inside the shortfall, where derivatives include it.
const SOFT: [Soft; 7] = [
    Soft { least: 0.1, price: 0.01 },
    Soft { least: 0.05, price: 0.1 },
    Soft { least: 0.02, price: 1.0 },
    Soft { least: 0.005, price: 10.0 },
    Soft { least: 0.001, price: 100.0 },
    Soft { least: 0.001, price: 1e3 },
    Soft { least: 0.001, price: 1e4 },
];
/// Iterations at the first softness, at each further one, and with the exact objective.
const FIRST_TURNS: usize = 15;
const SOFT_TURNS: usize = 8;
const EXACT_TURNS: usize = 10;
/// Share of the score that the distance from a collision may cost.
const EDGE_COST: f64 = 1e-4;
/// Gain of an iteration, as a share of the cost, below which a descent has converged at its end.
const FINE: f64 = 1e-6;
/// An unfulfilled promise of the derivatives, as a share of the score: below it a point is an optimum, above it a polish follows.
const PROMISE: f64 = 1e-4;
/// Rise of the score, as a share of it, to the points from which a polish at an edge starts, and their number per parameter.
const EDGE: f64 = 1e-4;
const EDGES: usize = 4;
/// Largest number of simulations of a polish per parameter, and the unit of its generations: the lanes of a small block.
const POLISH: usize = 250;
const LANES: usize = 16;
/// Curvature of a parameter without effect, as a share of the largest.
const WIDEST: f64 = 1e-4;
/// Distance of a delay above a whole number of samples \[s\], so that rounding cannot move it below.
const BEHIND_A_SAMPLE: f64 = 1e-6;

/// A soft run under a pull.
pub fn pulled(share: f64) -> Pull {
    Pull { share, soft: Some(SOFT[0]) }
}

/// A point from which a descent went to its end.
pub struct Basin {
    entry: Walker,
    end: Ending,
}

/// The end of a descent by the exact objective.
#[derive(Clone)]
struct Ending {
    place: Vec<f64>,
    score: f64,
    promise: f64,
    held: Vec<usize>,
}

/// The score of the basin that a point has met, if any.
pub fn met(basins: &[Basin], walker: &Walker) -> Option<f64> {
    let basins = basins.iter().filter(|basin| {
        let ahead = basin.entry.cost - walker.cost;
        ahead <= AHEAD * basin.entry.cost && walker.has_met(&basin.entry)
    });
    basins.map(|basin| basin.end.score).min_by(f64::total_cmp)
}

impl Search<'_> {
    /// Continues from the best points to the end: collisions become hard, delays whole if the convention has whole ones. Returns the lowest
    /// exact score.
    pub(super) async fn finish(&mut self, walkers: Vec<Walker>, most: usize) -> Result<f64, CalibrateError> {
        let Some(best) = walkers.first().map(|walker| walker.cost) else { return Ok(f64::INFINITY) };
        let near = |walker: &Walker| self.record.stopped.is_some() || walker.cost <= best * BEHIND;
        let (known, entries): (Vec<Walker>, Vec<Walker>) =
            walkers.into_iter().filter(near).take(most).partition(|walker| met(&self.basins, walker).is_some());
        let mut lowest = known.iter().filter_map(|walker| met(&self.basins, walker)).fold(f64::INFINITY, f64::min);
        let mut walkers = entries.clone();
        for (level, soft) in SOFT.into_iter().enumerate() {
            let places: Vec<Vec<f64>> = walkers.iter().map(|walker| walker.place.clone()).collect();
            if self.record.stopped.is_some()
                || places.is_empty()
                || level > 0 && !self.any_pays(&places, SOFT[level - 1]).await?
            {
                break;
            }
            let turns = if level == 0 { FIRST_TURNS } else { SOFT_TURNS };
            let course = Course { pull: Pull { share: 0.0, soft: Some(soft) }, turns, tolerance: FINE };
            walkers = descend_on(&self.smooth, places, &[], course, &mut self.record).await?;
        }
        if self.record.stopped.is_some() {
            self.score_exactly(&walkers.into_iter().map(|walker| walker.place).collect::<Vec<_>>()).await?;
            return Ok(f64::INFINITY);
        }
        for (entry, walker) in entries.into_iter().zip(walkers) {
            let mut end: Option<Ending> = None;
            for (place, held) in self.with_whole_delays(&walker.place) {
                let mut ending = self.exactly(place, held).await?;
                // A penalty has a slope at the edge of the feasible region, where the score has none.
                ending.promise = ending.promise.min(walker.promise);
                if end.as_ref().is_none_or(|end| ending.score < end.score) {
                    end = Some(ending);
                }
            }
            let end = end.expect("at least one delay");
            lowest = lowest.min(end.score);
            if end.score.is_finite() {
                self.keep(end.place.clone(), end.score);
            }
            self.basins.push(Basin { entry, end });
        }
        self.compare_with_target()?;
        Ok(lowest)
    }

    /// Refines the best basin: by differences across kinks, and by scores alone if derivatives still promise a gain.
    pub(super) async fn polish(&mut self) -> Result<(), CalibrateError> {
        let best = self.basins.iter().map(|basin| &basin.end).min_by(|a, b| a.score.total_cmp(&b.score));
        let Some(mut end) = best.filter(|end| end.score.is_finite()).cloned() else { return Ok(()) };
        let course = Course { pull: Pull::NONE, turns: EXACT_TURNS, tolerance: FINE };
        let walkers = descend_on(&self.across, vec![end.place.clone()], &end.held, course, &mut self.record).await?;
        if let Some(walker) = walkers.into_iter().find(|walker| walker.cost < end.score) {
            self.keep(walker.place.clone(), walker.cost);
            let found = self.exactly(walker.place, end.held.clone()).await?;
            if found.score < end.score {
                // At the edge of the feasible region derivatives promise what no step gains, there as here.
                end = Ending { promise: found.promise.min(end.promise), ..found };
                self.keep(end.place.clone(), end.score);
            }
        }
        if end.promise.is_finite() && end.promise > PROMISE * end.score.max(FLOOR) {
            let (place, score) = self.polished((end.place, end.score), &end.held).await?;
            self.keep(place, score);
        }
        self.compare_with_target()
    }

    /// Descends by the exact objective, without `held` coordinates.
    async fn exactly(&mut self, place: Vec<f64>, held: Vec<usize>) -> Result<Ending, CalibrateError> {
        let mut ending = Ending { place, score: f64::INFINITY, promise: f64::INFINITY, held };
        if !self.record.spend(1) {
            return Ok(ending);
        }
        ending.score = self.exact.costs(std::slice::from_ref(&ending.place), Pull::NONE).await?[0];
        if ending.score.is_finite() {
            let course = Course { pull: Pull::NONE, turns: EXACT_TURNS, tolerance: FINE };
            let walkers =
                descend_on(&self.exact, vec![ending.place.clone()], &ending.held, course, &mut self.record).await?;
            if let Some(walker) = walkers.into_iter().find(|walker| walker.cost.is_finite()) {
                (ending.place, ending.score, ending.promise) = (walker.place, walker.cost, walker.promise);
            }
        }
        Ok(ending)
    }

    /// Descends by scores alone.
    async fn polished(&mut self, found: (Vec<f64>, f64), held: &[usize]) -> Result<(Vec<f64>, f64), CalibrateError> {
        let moved: Vec<usize> = (0..found.0.len()).filter(|i| !held.contains(i)).collect();
        let n = moved.len();
        if n == 0 {
            return Ok(found);
        }
        let points = self.around(&found.0, held, EDGE * found.1, EDGES * n).await?;
        if points.is_empty() {
            return Ok(found);
        }
        let take = |place: &Vec<f64>| moved.iter().map(|i| place[*i]).collect::<Vec<f64>>();
        let settings = DescentSettings {
            population: (2 * DescentSettings::population_for(n)).next_multiple_of(LANES),
            evaluations: (POLISH * n) as u64,
            tolerance: FINE,
            floor: FLOOR,
        };
        let start = Start::Population { middle: take(&found.0), points: points.iter().map(take).collect() };
        let unit = SearchBox { lower: vec![0.0; n], upper: vec![1.0; n] };
        let origin = Origin::new(self.record.settings.seed, self.record.number);
        let mut descent = Descent::new(unit, start, settings, origin);
        let whole = |point: &Vec<f64>| {
            let mut place = found.0.clone();
            moved.iter().zip(point).for_each(|(i, x)| place[*i] = *x);
            place
        };
        while descent.ended().is_none() {
            let points = descent.ask();
            if points.is_empty() || !self.record.spend(points.len()) {
                break;
            }
            let places: Vec<Vec<f64>> = points.iter().map(whole).collect();
            let scores = self.exact.scores(&places, Pull::NONE).await;
            let merits: Vec<Merit> = scores.iter().map(|(score, _)| merit(score)).collect();
            descent.tell(&merits);
        }
        Ok(match descent.best().map(|member| (&member.point, member.merit)) {
            Some((point, Merit::Feasible(score))) if score < found.1 => (whole(point), score),
            _ => found,
        })
    }

    /// Ends the search if the best score, by the reference, is good enough.
    fn compare_with_target(&mut self) -> Result<(), CalibrateError> {
        let Record { best, settings, stopped, .. } = &mut self.record;
        let Some(((place, score), target)) = best.as_ref().zip(settings.stop.target) else { return Ok(()) };
        if *score <= target && stopped.is_none() {
            let parameters = self.exact.parameters(place);
            let score = rescore::score(self.exact.cases(), self.exact.gof(), &parameters)?;
            *stopped = matches!(score, Score::Value(score) if score <= target).then_some(StopReason::Target);
        }
        Ok(())
    }

    /// The exact scores of some points, so that a stopped search has a result.
    pub(super) async fn score_exactly(&mut self, places: &[Vec<f64>]) -> Result<(), CalibrateError> {
        let places = &places[..places.len().min(LAST / 2)];
        self.record.evaluations += places.len() as u64;
        let costs = self.exact.costs(places, Pull::NONE).await?;
        for (place, cost) in places.iter().zip(costs).filter(|(_, cost)| cost.is_finite()) {
            self.keep(place.clone(), cost);
        }
        self.compare_with_target()
    }

    /// True if a point at the optimum of a softness collides, or loses much by its distance from a collision.
    async fn any_pays(&mut self, places: &[Vec<f64>], soft: Soft) -> Result<bool, CalibrateError> {
        if !self.record.spend(places.len()) {
            return Ok(false);
        }
        let scores = self.smooth.scores(places, Pull { share: 0.0, soft: Some(soft) }).await;
        let pays = |(score, square): &(Score, f64)| {
            let Score::Value(score) = score else { return true };
            let shortfall = square.sqrt();
            // The slope of the penalty equals that of the score.
            shortfall >= soft.least || 2.0 * soft.price * shortfall * soft.least > EDGE_COST * score.max(FLOOR)
        };
        Ok(scores.iter().any(pays))
    }

    /// The point, and no held coordinate; if the convention floors delays, the points with the delay at the two whole numbers of samples
    /// around it, and the coordinate of the delay.
    fn with_whole_delays(&self, place: &[f64]) -> Vec<(Vec<f64>, Vec<usize>)> {
        let Some((at, delays)) = self.whole_delays(place) else { return vec![(place.to_vec(), Vec::new())] };
        let with = |delay: f64| {
            let mut place = place.to_vec();
            place[at] = delay;
            (place, vec![at])
        };
        delays.into_iter().map(with).collect()
    }

    /// If the convention floors delays: the coordinate of the delay, and its values at the two whole numbers of samples around it.
    fn whole_delays(&self, place: &[f64]) -> Option<(usize, Vec<f64>)> {
        let case = &self.exact.cases()[0];
        if case.convention.delay != Delay::Floor || !case.variant.perceives_late() {
            return None;
        }
        let symbols = case.variant.parameters();
        let candidate = self.exact.candidate(place);
        let delays = [Some(Symbol::tau_p), case.variant.extensions.delay()];
        let parameters =
            delays.into_iter().flatten().filter_map(|delay| symbols.iter().position(|known| *known == delay));
        let parameters: Vec<usize> = parameters.collect();
        let (at, parameter) = parameters.iter().find_map(|&parameter| {
            let (at, _) = self.exact.coordinate(parameter, candidate[parameter])?;
            Some((at, parameter))
        })?;
        let whole: f64 = parameters.iter().map(|&parameter| candidate[parameter]).sum();
        let others = whole - candidate[parameter];
        let of = |steps: f64| {
            let delay = steps * case.dt + BEHIND_A_SAMPLE - others;
            self.exact.coordinate(parameter, delay).map(|(_, u)| u.clamp(0.0, 1.0))
        };
        let steps = (whole / case.dt).floor();
        Some((at, [steps, steps + 1.0].into_iter().filter_map(of).collect()))
    }

    /// Points around another one, at which costs rise on average by this value.
    async fn around(
        &mut self,
        middle: &[f64],
        held: &[usize],
        rise: f64,
        count: usize,
    ) -> Result<Vec<Vec<f64>>, CalibrateError> {
        let n = middle.len();
        if !self.record.spend(n + 1 - held.len()) {
            return Ok(Vec::new());
        }
        let curvature = self.smooth.slopes(&[&middle.to_vec()], held, pulled(0.0)).await?.remove(0).majorant;
        let largest = curvature.diagonal().max();
        let floor = DMatrix::from_diagonal_element(n, n, (WIDEST * largest).max(f64::MIN_POSITIVE.sqrt()));
        let Some(root) = (curvature + floor).cholesky() else { return Ok(Vec::new()) };
        let mut rng = stream(self.record.settings.seed, self.record.number, u64::MAX, self.record.evaluations);
        let size = (2.0 * rise / n as f64).sqrt();
        let mut place = || {
            let draw = DVector::from_fn(n, |_, _| size * normal(&mut rng));
            let step = root.l().transpose().solve_upper_triangular(&draw).unwrap_or(draw);
            let moved = |(i, x): (usize, &f64)| if held.contains(&i) { *x } else { (x + step[i]).clamp(0.0, 1.0) };
            middle.iter().enumerate().map(moved).collect()
        };
        Ok((0..count).map(|_| place()).collect())
    }
}
