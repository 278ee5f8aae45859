//! Profiles: one parameter is moved away from its calibrated value, and all others are calibrated again.
//!
//! Two profiles per parameter, one on each side, go side by side: their candidates are simulated together.

use super::local::{Local, Spread};
use crate::calibrate::{SearchSpace, merit};
use crate::evaluator::{EvaluateError, Evaluator, Population, Score};
use crate::optimize::{Descent, DescentSettings, Merit, Optimizer, Origin, SearchBox, Start};
use nalgebra::DMatrix;

/// Points per profile; the end is interpolated between the two that are nearest.
const POINTS: usize = 3;

/// Candidates of a generation, and generations, of a descent in the other parameters. It starts from the bottom of the quadratic
/// valley with the shape of that valley, so that little is left to do.
const POPULATION: usize = 12;
const GENERATIONS: u64 = 16;

/// Step of these descents: a share of the interval that the quadratic form gives.
const STEP: f64 = 0.3;

/// A factor by which the distance may change from one point to the next.
const LARGEST_CHANGE: f64 = 4.0;

/// The end of a profile.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    /// Where, as a share of the range.
    pub(super) at: f64,
    /// True if the bound came first.
    pub(super) open: bool,
}

pub(super) struct Profiles {
    /// Lower and upper end per parameter.
    pub(super) ends: Vec<[End; 2]>,
    /// Score of the candidate by the evaluator that simulated the profiles, and the lowest that they met.
    pub(super) start: f64,
    pub(super) lowest: f64,
    pub(super) evaluations: u64,
}

/// One side of one parameter.
struct Side {
    k: usize,
    /// Calibrated value, and the bound on this side, as shares of the range.
    middle: f64,
    bound: f64,
    /// (distance from the calibrated value, √ of the rise), nearest first, from (0, 0) on; the rise is infinite where nothing is feasible.
    points: Vec<(f64, f64)>,
    /// Distance of the point under way; none once the end is known.
    next: Option<f64>,
}

impl Side {
    fn room(&self) -> f64 {
        (self.bound - self.middle).abs()
    }

    fn at(&self, distance: f64) -> f64 {
        (self.middle + distance * (self.bound - self.middle).signum()).clamp(0.0, 1.0)
    }

    /// The points on both sides of a rise: the last one below, the first one not below.
    fn bracket(&self, wanted: f64) -> ((f64, f64), Option<(f64, f64)>) {
        let above = self.points.iter().position(|(_, root)| *root >= wanted);
        match above {
            Some(k) => (self.points[k - 1], Some(self.points[k])),
            None => (self.points[self.points.len() - 1], None),
        }
    }

    /// Where √ of the rise would be `wanted`, linearly.
    fn estimate(&self, wanted: f64) -> f64 {
        let ((d0, r0), above) = self.bracket(wanted);
        match above {
            Some((d1, r1)) if r1.is_finite() => d0 + (d1 - d0) * (wanted - r0) / (r1 - r0),
            Some((d1, _)) => 0.5 * (d0 + d1),
            None if r0 > 0.0 => d0 * (wanted / r0).min(LARGEST_CHANGE),
            None => d0 * LARGEST_CHANGE,
        }
    }

    /// Takes a point, and decides on the next one.
    fn add(&mut self, distance: f64, root: f64, wanted: f64) {
        self.points.push((distance, root));
        self.points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at_bound = distance >= self.room();
        let close = (root / wanted - 1.0).abs() < 0.05;
        let enough = self.points.len() > POINTS;
        let done = close || enough || (at_bound && root < wanted);
        self.next = (!done).then(|| self.estimate(wanted).min(self.room()));
    }

    fn end(&self, wanted: f64) -> End {
        let (below, above) = self.bracket(wanted);
        let reached = self.estimate(wanted).min(self.room());
        // Not reached: the bound, or as far as it was followed.
        let open = above.is_none() && (below.0 >= self.room() || reached >= self.room());
        End { at: self.at(if open { self.room() } else { reached }), open }
    }
}

/// A calibration of the other parameters under way.
struct Task {
    side: usize,
    distance: f64,
    /// The bottom of the quadratic valley, then the descent from it.
    valley: Vec<f64>,
    descent: Option<Descent>,
    best: Merit,
}

/// All profiles.
pub(super) fn profiles(
    evaluator: &mut dyn Evaluator,
    space: &SearchSpace,
    candidate: &[f64],
    local: &Local,
    spreads: &[Spread],
    seed: u64,
) -> Result<Profiles, EvaluateError> {
    let mut work = Work::new(evaluator, space, candidate, local);
    let start = match work.merits(&[work.middle.clone()])?[0] {
        Merit::Feasible(value) => value,
        // On the edge: nothing can be said about what lies around, and no profile is begun.
        Merit::Infeasible { .. } => f64::INFINITY,
    };
    let mut lowest = start;
    let mut sides: Vec<Side> = (0..2 * local.free.len())
        .map(|side| {
            let (k, middle) = (side / 2, work.middle[side / 2]);
            let mut side = Side { k, middle, bound: (side % 2) as f64, points: vec![(0.0, 0.0)], next: None };
            side.next = (side.room() > 0.0).then(|| spreads[k].half.min(side.room()));
            side
        })
        .collect();
    let mut round = 0;
    while start.is_finite() && sides.iter().any(|side| side.next.is_some()) {
        let origin = Origin { seed, replicate: u64::MAX, generation: round << 32 };
        let risen = work.risen(&sides, spreads, start, origin)?;
        for (side, distance, merit) in risen {
            let root = match merit {
                Merit::Feasible(value) => {
                    lowest = lowest.min(value);
                    (value - start).max(0.0).sqrt()
                }
                Merit::Infeasible { .. } => f64::INFINITY,
            };
            let wanted = spreads[sides[side].k].rise.sqrt();
            sides[side].add(distance, root, wanted);
        }
        round += 1;
    }
    let end = |side: &Side| match side.room() > 0.0 {
        true => side.end(spreads[side.k].rise.sqrt()),
        false => End { at: side.bound, open: true },
    };
    let ends = sides.chunks(2).map(|pair| [end(&pair[0]), end(&pair[1])]).collect();
    Ok(Profiles { ends, start, lowest, evaluations: work.evaluations })
}

/// What evaluates points of the unit cube.
struct Work<'a> {
    evaluator: &'a mut dyn Evaluator,
    space: &'a SearchSpace,
    local: &'a Local,
    /// The calibrated candidate: fixed parameters as they are, and the searched ones as shares of their ranges.
    candidate: &'a [f64],
    middle: Vec<f64>,
    population: Population,
    evaluations: u64,
}

impl<'a> Work<'a> {
    fn new(evaluator: &'a mut dyn Evaluator, space: &'a SearchSpace, candidate: &'a [f64], local: &'a Local) -> Self {
        let share = |&i: &usize| {
            let [lower, upper] = space.bounds[i];
            ((candidate[i] - lower) / (upper - lower)).clamp(0.0, 1.0)
        };
        let middle = local.free.iter().map(share).collect();
        let population = Population::new(&space.symbols);
        Work { evaluator, space, local, candidate, middle, population, evaluations: 0 }
    }

    fn merits(&mut self, points: &[Vec<f64>]) -> Result<Vec<Merit>, EvaluateError> {
        self.population.clear();
        for point in points {
            let mut values = self.candidate.to_vec();
            for (&i, x) in self.local.free.iter().zip(point) {
                let [lower, upper] = self.space.bounds[i];
                values[i] = (lower + x * (upper - lower)).min(upper);
            }
            self.population.push(&values);
        }
        let mut scores = vec![Score::Rejected; points.len()];
        self.evaluator.evaluate(&self.population, &mut scores)?;
        self.evaluations += points.len() as u64;
        Ok(scores.iter().map(merit).collect())
    }

    /// The next point of every side that has one: side, distance, merit with all others calibrated again.
    fn risen(
        &mut self,
        sides: &[Side],
        spreads: &[Spread],
        start: f64,
        origin: Origin,
    ) -> Result<Vec<(usize, f64, Merit)>, EvaluateError> {
        let going = sides.iter().enumerate().filter_map(|(side, s)| Some((side, s.next?)));
        let mut tasks: Vec<Task> = going
            .map(|(side, distance)| self.task(side, &sides[side], distance, &spreads[sides[side].k], start, origin))
            .collect();
        let valleys: Vec<Vec<f64>> = tasks.iter().map(|task| task.valley.clone()).collect();
        for (task, merit) in tasks.iter_mut().zip(self.merits(&valleys)?) {
            task.best = merit;
        }
        loop {
            let mut points = Vec::new();
            let mut parts = Vec::new();
            for (t, task) in tasks.iter_mut().enumerate() {
                let Some(descent) = task.descent.as_mut().filter(|descent| descent.ended().is_none()) else { continue };
                let (k, fixed) = (sides[task.side].k, task.valley[sides[task.side].k]);
                let asked = descent.ask();
                parts.push((t, asked.len()));
                points.extend(asked.into_iter().map(|mut others| {
                    others.insert(k, fixed);
                    others
                }));
            }
            if parts.is_empty() {
                break;
            }
            let merits = self.merits(&points)?;
            let mut rest = &merits[..];
            for (t, count) in parts {
                let (own, others) = rest.split_at(count);
                let task = &mut tasks[t];
                task.descent.as_mut().expect("it asked").tell(own);
                task.best = own.iter().copied().fold(task.best, |a, b| if b.beats(&a) { b } else { a });
                rest = others;
            }
        }
        Ok(tasks.into_iter().map(|task| (task.side, task.distance, task.best)).collect())
    }

    fn task(&self, number: usize, side: &Side, distance: f64, spread: &Spread, start: f64, origin: Origin) -> Task {
        let k = side.k;
        let fixed = side.at(distance);
        let follow = self.local.follow(k);
        let mut valley: Vec<f64> = self
            .middle
            .iter()
            .zip(follow.iter())
            .map(|(x, slope)| (x + slope * (fixed - side.middle)).clamp(0.0, 1.0))
            .collect();
        valley[k] = fixed;
        let mut others = valley.clone();
        others.remove(k);
        let n = others.len();
        let descent = (n > 0).then(|| {
            // Points at the ends of the axes of the valley at this height: their covariance is its shape.
            let form = self.local.curvature.clone().remove_row(k).remove_column(k);
            let inverse = form.clone().cholesky().map_or_else(|| DMatrix::identity(n, n), |c| c.inverse());
            let scale = STEP * (2.0 * spread.rise * n as f64).sqrt();
            let root = inverse.cholesky().map_or_else(|| DMatrix::identity(n, n), |c| c.l());
            let along = |i: usize, sign: f64| -> Vec<f64> {
                let column = root.column(i);
                others.iter().zip(column.iter()).map(|(x, y)| x + (sign * scale * y).clamp(-STEP, STEP)).collect()
            };
            let points = (0..n).flat_map(|i| [along(i, 1.0), along(i, -1.0)]).collect();
            let settings = DescentSettings {
                population: POPULATION,
                evaluations: POPULATION as u64 * GENERATIONS,
                // A hundredth of the rise.
                tolerance: 0.01 * spread.rise / start.abs().max(f64::MIN_POSITIVE),
                floor: 0.0,
            };
            let space = SearchBox { lower: vec![0.0; n], upper: vec![1.0; n] };
            let origin = Origin { generation: origin.generation + ((number as u64) << 16), ..origin };
            Descent::new(space, Start::Population { middle: others.clone(), points }, settings, origin)
        });
        Task { side: number, distance, valley, descent, best: Merit::Infeasible { survived: 0 } }
    }
}
