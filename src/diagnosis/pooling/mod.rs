//! One law for many drivers who differ: common parameters, and some of each driver's own, which have a distribution (empirical Bayes).
//!
//! 1. `near`: the penalty for the distance from the middle of the distribution. The race has it, too.
//! 2. `surface`: the score of drives with displaced parameters.
//! 3. `distribution`: middle and spread, from what the drives of each driver say.
//! 4. Here: the three in turns, until the spreads settle.

mod distribution;
mod near;
mod surface;

pub use distribution::{Distribution, Evidence};
pub use near::Near;
pub use surface::{Displaced, Squared};

use crate::calibrate::SearchSpace;
use crate::calibrate::descent::{Course, Surface, Watch, descend};
use crate::diagnose::likelihood::space::Axis;
use crate::evaluator::{Case, EvaluateError, Pull};
use crate::identify::{Exactly, information};
use crate::lanes::{Lanes, LanesPrecision};
use crate::score::GoodnessOfFit;
use nalgebra::DVector;
use rayon::prelude::*;

/// Smallest number of drivers with a distribution: of ten normal numbers the standard deviation is known to a quarter.
pub const LEAST_DRIVERS: usize = 10;
/// Turns at most; spreads settle within three to five.
const TURNS: usize = 8;
/// Iterations of a descent within a turn: the next turn continues.
const ITERATIONS: usize = 6;
/// Gain of an iteration, as a share of the score, below which a descent has converged.
const TOLERANCE: f64 = 1e-5;
/// Standard deviation of a parameter over drivers as a share of its value, before it is known: headways of human drivers differ by about a third.
pub const SPREAD: f64 = 0.35;
/// Spreads have settled if none changes by more than this share of itself, or of [`SPREAD`] of its axis.
const SETTLED: f64 = 0.02;
/// Smallest spread, as a share of the axis, at which drivers differ at all.
const NONE: f64 = 1e-4;

/// A parameter that drivers have of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Own {
    /// Its position in the search space.
    pub position: usize,
    /// True if its logarithm is normally distributed: if its bounds have one sign.
    pub log: bool,
    /// The value in the middle.
    pub middle: f64,
    /// 95 % interval of the middle.
    pub middle_interval: [f64; 2],
    /// Standard deviation over drivers: of the logarithm, or in the unit of the parameter.
    pub spread: f64,
    /// 95 % interval of the spread.
    pub spread_interval: [f64; 2],
}

/// A partly pooled law.
#[derive(Debug, Clone, PartialEq)]
pub struct Pooled {
    /// Parameters of a driver of whom nothing is known.
    pub middle: Vec<f64>,
    /// The distributions.
    pub own: Vec<Own>,
    /// Parameters of each driver.
    pub drivers: Vec<Vec<f64>>,
}

struct Stopping<'a>(&'a (dyn Fn() -> bool + Sync));

impl Watch for Stopping<'_> {
    fn spend(&mut self, _: usize) -> bool {
        !(self.0)()
    }
}

/// Fits common and own parameters from a common candidate that completes all drives; `drivers` has the cases of each driver, `own` the
/// positions of the own parameters. `None` after a stop.
///
/// # Errors
/// When the evaluator fails.
pub fn partly_pooled(
    cases: &[Case],
    gof: GoodnessOfFit,
    space: &SearchSpace,
    (own, drivers): (&[usize], &[Vec<usize>]),
    start: &[f64],
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Pooled>, EvaluateError> {
    // The drives of a driver lie side by side.
    let ordered = drivers.iter().flatten().map(|case| cases[*case].clone()).collect();
    let lanes = Lanes::new(ordered, gof, LanesPrecision::F64)?;
    let firsts = drivers.iter().scan(0, |next, own| {
        *next += own.len();
        Some(*next - own.len())
    });
    let axis = |[lower, upper]: &[f64; 2]| match lower * upper > 0.0 {
        true => Axis::log(*lower, *upper),
        false => Axis::linear(*lower, *upper),
    };
    let axes: Vec<Axis> = space.bounds.iter().map(axis).collect();
    let place = axes.iter().zip(start).map(|(axis, value)| axis.coordinate(*value)).collect();
    let drivers = firsts.zip(drivers).map(|(first, own)| Driver { first, count: own.len(), by: vec![0.0; axes.len()] });
    let fleet = Fleet { lanes: &lanes, space, axes: &axes, own, drivers: drivers.collect(), place };
    fleet.settle(stop)
}

struct Driver {
    first: usize,
    count: usize,
    /// Displacement of the driver's parameters from the common ones.
    by: Vec<f64>,
}

struct Fleet<'a> {
    lanes: &'a Lanes,
    space: &'a SearchSpace,
    axes: &'a [Axis],
    own: &'a [usize],
    drivers: Vec<Driver>,
    /// Coordinates of the common parameters, and of the middles of the own ones.
    place: Vec<f64>,
}

/// What the drives of a driver say about displacements from the middle, and the information in a unit of the curvature of the score.
struct Known {
    evidence: Evidence,
    per_curvature: Vec<f64>,
}

impl Fleet<'_> {
    fn settle(mut self, stop: &(dyn Fn() -> bool + Sync)) -> Result<Option<Pooled>, EvaluateError> {
        let firsts: Vec<f64> = self.own.iter().map(|k| self.axes[*k].distance(self.place[*k], SPREAD)).collect();
        let mut spread = firsts.clone();
        for turn in 0..TURNS {
            let known = self.known(stop)?;
            if stop() {
                return Ok(None);
            }
            let mut settled = false;
            if turn > 0 {
                let found = self.distribution(&known);
                let near = |((new, old), first): ((&f64, &f64), &f64)| (new - old).abs() <= SETTLED * new.max(*first);
                settled = found.spread.iter().zip(&spread).zip(&firsts).all(near);
                self.move_middle(&found.middle);
                spread = found.spread;
            }
            self.fit_drivers(&known, &spread, stop)?;
            if settled || turn + 1 == TURNS {
                break;
            }
            self.fit_common(stop)?;
        }
        let found = self.distribution(&self.known(stop)?);
        Ok((!stop()).then(|| self.pooled(&found)))
    }

    /// What the drives of each driver say; `None` for one whose drives say nothing.
    fn known(&self, stop: &(dyn Fn() -> bool + Sync)) -> Result<Vec<Option<Known>>, EvaluateError> {
        let one = |driver: &Driver| -> Result<Option<Known>, EvaluateError> {
            let candidate = Displaced::values(self.axes, &self.place, &driver.by);
            let mut space = self.space.clone();
            for k in (0..candidate.len()).filter(|k| !self.own.contains(k)) {
                space.bounds[k] = [candidate[k]; 2];
            }
            let exactly = Exactly { lanes: self.lanes, first: driver.first, count: driver.count };
            let Some(found) = information(exactly, &space, &candidate, &mut || stop())? else { return Ok(None) };
            // From shares of the range to coordinates. The free parameters are in the order of the space.
            let mut free = self.own.to_vec();
            free.sort_unstable();
            let order: Vec<usize> =
                self.own.iter().map(|k| free.iter().position(|own| own == k).unwrap_or(0)).collect();
            let slope = |k: usize| {
                let (axis, at) = (&self.axes[k], self.place[k] + driver.by[k]);
                axis.slope(at.clamp(0.0, 1.0)) / (axis.upper - axis.lower)
            };
            let slopes = DVector::from_iterator(self.own.len(), self.own.iter().map(|k| slope(*k)));
            let n = self.own.len();
            let matrix =
                nalgebra::DMatrix::from_fn(n, n, |a, b| found.matrix[(order[a], order[b])] * slopes[a] * slopes[b]);
            let by = DVector::from_iterator(n, self.own.iter().map(|k| driver.by[*k]));
            let vector = DVector::from_fn(n, |a, _| found.vector[order[a]] * slopes[a]) + &matrix * by;
            let per_curvature =
                (0..n).map(|a| found.matrix[(order[a], order[a])] / found.curvature[order[a]]).collect();
            Ok(Some(Known { evidence: Evidence { matrix, vector }, per_curvature }))
        };
        self.drivers.par_iter().map(one).collect()
    }

    fn distribution(&self, known: &[Option<Known>]) -> Distribution {
        let evidence: Vec<Evidence> = known.iter().flatten().map(|known| known.evidence.clone()).collect();
        Distribution::of(&evidence, self.own.len())
    }

    /// Moves the common point to the middle; the drivers stay where they are.
    fn move_middle(&mut self, middle: &[f64]) {
        for (&k, by) in self.own.iter().zip(middle) {
            let to = (self.place[k] + by).clamp(0.0, 1.0);
            let by = to - std::mem::replace(&mut self.place[k], to);
            self.drivers.iter_mut().for_each(|driver| driver.by[k] -= by);
        }
    }

    /// The parameters of each driver, near the middle.
    fn fit_drivers(
        &mut self,
        known: &[Option<Known>],
        spread: &[f64],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), EvaluateError> {
        let none = vec![0.0; self.axes.len()];
        let one = |(driver, known): (&Driver, &Option<Known>)| -> Result<Vec<f64>, EvaluateError> {
            let mut weights = vec![0.0; self.axes.len()];
            for (i, &k) in self.own.iter().enumerate().filter(|(i, _)| spread[*i] > NONE) {
                let evidence = known.as_ref().map_or(0.0, |known| known.per_curvature[i]);
                // Of whom nothing is known, he is in the middle.
                weights[k] = if evidence > 0.0 { 0.5 / (evidence * spread[i] * spread[i]) } else { 0.0 };
            }
            let held: Vec<usize> = (0..weights.len()).filter(|k| weights[*k] <= 0.0).collect();
            let drives = (driver.first..driver.first + driver.count).map(|case| (case, &none[..])).collect();
            let surface = Displaced { lanes: self.lanes, space: self.space, axes: self.axes, drives };
            let present: Vec<f64> =
                self.place.iter().zip(&driver.by).map(|(common, by)| (common + by).clamp(0.0, 1.0)).collect();
            let scale = surface.costs(std::slice::from_ref(&present), Pull::NONE)?[0];
            let near = Near { surface: Squared { surface, scale }, centre: &self.place, weights };
            let course = Course { pull: Pull::NONE, turns: ITERATIONS, tolerance: TOLERANCE };
            let start =
                (0..present.len()).map(|k| if held.contains(&k) { self.place[k] } else { present[k] }).collect();
            let walkers = descend(&near, vec![start, self.place.clone()], &held, course, &mut Stopping(stop))?;
            let best = walkers.into_iter().filter(|w| w.cost.is_finite()).min_by(|a, b| a.cost.total_cmp(&b.cost));
            // A driver who would collide elsewhere stays.
            let place = best.map_or(present, |walker| walker.place);
            Ok(place.iter().zip(&self.place).map(|(own, common)| own - common).collect())
        };
        let found: Vec<Vec<f64>> =
            self.drivers.par_iter().zip(known.par_iter()).map(one).collect::<Result<_, EvaluateError>>()?;
        self.drivers.iter_mut().zip(found).for_each(|(driver, by)| driver.by = by);
        Ok(())
    }

    /// The common parameters; with those of the drivers, whose middle moves.
    fn fit_common(&mut self, stop: &(dyn Fn() -> bool + Sync)) -> Result<(), EvaluateError> {
        let of = |driver: &'_ Driver| driver.first..driver.first + driver.count;
        let drives = self.drivers.iter().flat_map(|driver| of(driver).map(|case| (case, &driver.by[..])));
        let surface = Displaced { lanes: self.lanes, space: self.space, axes: self.axes, drives: drives.collect() };
        let held: Vec<usize> = (0..self.axes.len()).filter(|k| self.axes[*k].is_fixed()).collect();
        let course = Course { pull: Pull::NONE, turns: ITERATIONS, tolerance: TOLERANCE };
        let walkers = descend(&surface, vec![self.place.clone()], &held, course, &mut Stopping(stop))?;
        if let Some(walker) = walkers.into_iter().find(|walker| walker.cost.is_finite()) {
            self.place = walker.place;
        }
        Ok(())
    }

    fn pooled(&self, found: &Distribution) -> Pooled {
        let none = vec![0.0; self.axes.len()];
        let one = |(i, &k): (usize, &usize)| {
            let axis = &self.axes[k];
            let unit = if axis.log { (axis.upper / axis.lower).ln().abs() } else { axis.upper - axis.lower };
            // A logarithm of negative values runs from the lower bound to the upper one, so the order of the ends is kept.
            let value = |u: f64| axis.value(self.place[k] + u);
            Own {
                position: k,
                log: axis.log,
                middle: value(0.0),
                middle_interval: found.middle_interval[i].map(|end| value(end - found.middle[i])),
                spread: unit * found.spread[i],
                spread_interval: found.spread_interval[i].map(|end| unit * end),
            }
        };
        Pooled {
            middle: Displaced::values(self.axes, &self.place, &none),
            own: self.own.iter().enumerate().map(one).collect(),
            drivers: self.drivers.iter().map(|driver| Displaced::values(self.axes, &self.place, &driver.by)).collect(),
        }
    }
}
