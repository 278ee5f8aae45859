//! Maximum likelihood of a model and its noise together, from many starts at once.
//!
//! Every iteration simulates the finite differences of all starts in one batch, then steps of each with several dampings
//! (Levenberg-Marquardt with Fisher's information). It drops the worse starts after some iterations. Noise and parameters move together,
//! because alternating searches stop far from the optimum.

mod drives;
mod frame;
mod profile;

pub use frame::Prior;
pub use profile::profiled;

use super::normal_equations::NormalEquations;
use super::observer::{KalmanGain, Noise};
use super::robust::Mask;
use super::space::Axis;
use crate::evaluator::{Failure, Residuals};
use drives::{costs, derivatives};
use frame::{Frame, Place, inverse};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Residuals of spacing \[m\] and speed \[m/s\] of a whole run, sample by sample; `None` if it failed.
pub type Run = Option<Vec<[f64; 2]>>;

/// A model that gives innovations for parameters and an observer.
pub trait Predictor: Sync {
    /// Error of a simulation.
    type Error: Send;
    /// Samples and time step \[s\] of every drive.
    fn drives(&self) -> Vec<(usize, f64)>;
    /// False if a parameter of the model does nothing on a drive: candidates that differ in it alone then run alike.
    fn acts(&self, _drive: usize, _parameter: usize) -> bool {
        true
    }

    /// Simulated minus measured spacing and speed before each correction, candidate by candidate. `each` receives stretches of samples in
    /// order, up to the last one or until all candidates have failed. Returns where runs ended early.
    ///
    /// # Errors
    /// When nothing can be simulated; a candidate that fails is no error.
    fn residuals(
        &self,
        drive: usize,
        candidates: &[Vec<f64>],
        observers: &[KalmanGain],
        each: &mut dyn FnMut(&Residuals),
    ) -> Result<Vec<Option<Failure>>, Self::Error>;

    /// The same for whole runs.
    ///
    /// # Errors
    /// As [`Predictor::residuals`].
    fn runs(&self, drive: usize, candidates: &[Vec<f64>], observers: &[KalmanGain]) -> Result<Vec<Run>, Self::Error> {
        let mut runs = vec![Vec::with_capacity(self.drives()[drive].0); candidates.len()];
        let failed = self.residuals(drive, candidates, observers, &mut |stretch| {
            runs.par_iter_mut().enumerate().for_each(|(i, run)| run.extend(stretch.of(i)));
        })?;
        Ok(runs.into_iter().zip(failed).map(|(run, failed)| failed.is_none().then_some(run)).collect())
    }
}

/// A model with its noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Parameters of the model.
    pub values: Vec<f64>,
    /// The noise model.
    pub noise: Noise,
}

/// A point with its likelihood.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    pub point: Point,
    /// Gaussian log-likelihood over the fitted samples, without the constant.
    pub log_likelihood: f64,
    /// Standard errors of the parameters from Fisher's information; infinite if the data do not determine one, 0 if it is fixed.
    pub errors: Vec<f64>,
    /// True if the last iterations gained nothing.
    pub converged: bool,
    /// Coordinates 0..1 of the parameters, then logarithms of the noise.
    pub coordinates: Vec<f64>,
    /// Fisher's information and the gradient of the cost in these coordinates, at the last iteration; empty without one.
    pub information: DMatrix<f64>,
    /// See `information`.
    pub gradient: DVector<f64>,
}

/// The length of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Number of starts for each observer, the likeliest ones: likelihoods under different observers are not
    /// comparable.
    pub select: usize,
    /// Iterations of all starts.
    pub rough: usize,
    /// Starts that continue after them if they are close to the best, for each observer; further ones continue only while they catch up.
    pub keep: usize,
    /// Largest number of further iterations.
    pub fine: usize,
    /// Gain of an iteration below which a start has converged \[nats\].
    pub tolerance: f64,
    /// Smallest noise of spacing and speed in the search \[m, m/s\]; more than that of the sensors smooths a rugged likelihood. 0: as
    /// fitted.
    pub least: [f64; 2],
}

/// Longest step in the logarithm of a noise level, and in a coordinate of the model.
const LONGEST: [f64; 2] = [1.5, 0.4];
/// Weak prior towards the present noise, as information: fixes levels that the data do not determine.
const PULL: f64 = 0.05;
/// Factors of the damping tried in each iteration; they fill lanes of the evaluator that would be idle.
const DAMPINGS: [f64; 5] = [0.01, 0.1, 1.0, 10.0, 100.0];
/// Damping beyond which a start is stuck.
const STUCK: f64 = 1e7;
/// A start continues while it trails the best by at most this many of its last gains, or, among the best, by at most [`NEAR`] \[nats\].
const LATE: f64 = 12.0;
/// See [`LATE`].
const NEAR: f64 = 200.0;
#[derive(Debug, Clone)]
struct Start<'a> {
    place: Place<'a>,
    cost: f64,
    damping: f64,
    /// Gain of the last iteration \[nats\].
    gain: f64,
    /// Number of successive iterations that gained less than the tolerance.
    idle: usize,
    gram: Option<NormalEquations>,
}

/// Fits from all starts; the best comes first. Starts whose first run fails are left out unless all fail.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn fit<P: Predictor>(
    predictor: &P,
    axes: &[Axis],
    masks: &[Mask],
    starts: &[Point],
    plan: Plan,
) -> Result<Vec<Fit>, P::Error> {
    fit_with(predictor, axes, masks, starts, plan, None)
}

/// The same with a prior; likelihoods then include it.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn fit_with<P: Predictor>(
    predictor: &P,
    axes: &[Axis],
    masks: &[Mask],
    starts: &[Point],
    plan: Plan,
    prior: Option<&Prior>,
) -> Result<Vec<Fit>, P::Error> {
    let frame = Frame { axes, prior, least: plan.least };
    search(predictor, masks, starts.iter().map(|point| frame.place(point)).collect(), plan)
}

/// The same with separate axes for each start.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn fit_each<P: Predictor>(
    predictor: &P,
    masks: &[Mask],
    starts: &[(Vec<Axis>, Point)],
    plan: Plan,
) -> Result<Vec<Fit>, P::Error> {
    let frame = |axes| Frame { axes, prior: None, least: plan.least };
    search(predictor, masks, starts.iter().map(|(axes, point)| frame(axes).place(point)).collect(), plan)
}

fn search<P: Predictor>(
    predictor: &P,
    masks: &[Mask],
    places: Vec<Place<'_>>,
    plan: Plan,
) -> Result<Vec<Fit>, P::Error> {
    let costs = costs(predictor, masks, &places)?;
    let begin = |(place, cost)| Start { place, cost, damping: 1e-2, gain: 0.0, idle: 0, gram: None };
    let (mut starts, observers) = selected(places.into_iter().zip(costs).map(begin).collect(), plan.select);
    for turn in 0..plan.rough + plan.fine {
        if turn >= plan.rough {
            race(&mut starts, plan.keep, observers);
        }
        if !advance(predictor, masks, &mut starts, plan.tolerance)? {
            break;
        }
    }
    starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    Ok(starts.into_iter().map(finished).collect())
}

/// Drops the starts that trail by more than their last gain promises to recover.
fn race(starts: &mut Vec<Start<'_>>, keep: usize, observers: usize) {
    starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let ahead = starts.first().map_or(0.0, |best| best.cost);
    let mut rank = 0;
    starts.retain(|start| {
        rank += 1;
        let behind = start.cost - ahead;
        rank == 1 || behind <= LATE * start.gain || (rank <= keep && behind < NEAR)
    });
    starts.truncate(keep.max(1) * observers);
}

/// The likeliest starts under each observer whose first run does not fail, and the number of these observers.
fn selected<'a>(starts: Vec<Start<'a>>, most: usize) -> (Vec<Start<'a>>, usize) {
    let mut by_observer: Vec<Vec<Start<'a>>> = Vec::new();
    for start in starts.into_iter().filter(|start| start.cost.is_finite()) {
        match by_observer.iter_mut().find(|starts| starts[0].place.noise() == start.place.noise()) {
            Some(starts) => starts.push(start),
            None => by_observer.push(vec![start]),
        }
    }
    let observers = by_observer.len();
    let best = |mut starts: Vec<Start<'a>>| {
        starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        starts.truncate(most.max(1));
        starts
    };
    (by_observer.into_iter().flat_map(best).collect(), observers)
}

/// The log-likelihood of points, without a fit.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn log_likelihoods<P: Predictor>(
    predictor: &P,
    axes: &[Axis],
    masks: &[Mask],
    points: &[Point],
) -> Result<Vec<f64>, P::Error> {
    let frame = Frame { axes, prior: None, least: [0.0; 2] };
    let places: Vec<Place<'_>> = points.iter().map(|point| frame.place(point)).collect();
    Ok(costs(predictor, masks, &places)?.into_iter().map(|cost| -cost).collect())
}

fn finished(start: Start<'_>) -> Fit {
    let Place { frame, x } = start.place;
    let point = frame.point(&x);
    let mut errors = vec![f64::INFINITY; frame.axes.len()];
    let inverse = start.gram.as_ref().and_then(|gram| inverse(&frame, &gram.information));
    for (j, axis) in frame.axes.iter().enumerate() {
        let variance = inverse.as_ref().map_or(f64::INFINITY, |inverse| inverse[(j, j)]);
        let per_coordinate = axis.slope(x[j]);
        errors[j] = if axis.is_fixed() { 0.0 } else { variance.sqrt() * per_coordinate.abs() };
    }
    let (information, gradient) = match start.gram {
        Some(gram) => (gram.information, gram.gradient),
        None => (DMatrix::zeros(0, 0), DVector::zeros(0)),
    };
    Fit {
        point,
        log_likelihood: -start.cost,
        errors,
        converged: start.idle >= IDLE,
        coordinates: x,
        information,
        gradient,
    }
}

/// Iterations without gain after which a start has converged; one is enough if its derivatives promised no gain.
const IDLE: usize = 2;

/// One iteration of all starts that still move; false if none does.
fn advance<P: Predictor>(
    predictor: &P,
    masks: &[Mask],
    starts: &mut [Start<'_>],
    tolerance: f64,
) -> Result<bool, P::Error> {
    let moving: Vec<usize> =
        (0..starts.len()).filter(|&k| starts[k].idle < IDLE && starts[k].damping < STUCK).collect();
    if moving.is_empty() {
        return Ok(false);
    }
    let at: Vec<&Place<'_>> = moving.iter().map(|&k| &starts[k].place).collect();
    let grams = derivatives(predictor, masks, &at)?;
    let mut trials = Vec::new();
    for (&k, gram) in moving.iter().zip(&grams) {
        let Start { place, damping, .. } = &starts[k];
        trials.extend(DAMPINGS.map(|factor| step(place, gram, damping * factor)));
    }
    let costs = costs(predictor, masks, &trials)?;
    for (i, (&k, gram)) in moving.iter().zip(grams).enumerate() {
        let start = &mut starts[k];
        let mine = i * DAMPINGS.len()..(i + 1) * DAMPINGS.len();
        let best = mine.clone().min_by(|&a, &b| costs[a].total_cmp(&costs[b])).expect("there are dampings");
        let gain = start.cost - costs[best];
        let promised = trials[mine].iter().map(|to| gram.promise(&start.place.x, &to.x)).fold(0.0, f64::max);
        if gain > 0.0 {
            start.damping = (start.damping * DAMPINGS[best % DAMPINGS.len()]).max(1e-9);
            start.place.x.clone_from(&trials[best].x);
            start.cost = costs[best];
        } else {
            start.damping *= 100.0;
        }
        start.gain = gain.max(0.0);
        start.idle = match gain > tolerance {
            true => 0,
            false if promised <= tolerance => IDLE,
            false => start.idle + 1,
        };
        start.gram = Some(gram);
    }
    Ok(true)
}

/// A damped step within the bounds: coordinates that would leave them stay on them, and the step of the others is computed again.
fn step<'a>(place: &Place<'a>, gram: &NormalEquations, damping: f64) -> Place<'a> {
    let Place { frame, x } = place;
    let m = frame.coordinates();
    let model = frame.axes.len();
    let outward = |j: usize| {
        let ([lower, upper], g) = (frame.bounds(j), gram.gradient[j]);
        lower >= upper || (x[j] <= lower && g > 0.0) || (x[j] >= upper && g < 0.0)
    };
    let mut next = x.clone();
    let mut fixed: Vec<Option<f64>> = (0..m).map(|j| outward(j).then_some(0.0)).collect();
    for _ in 0..4 {
        let free: Vec<usize> = (0..m).filter(|&j| fixed[j].is_none()).collect();
        let matrix = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            let (j, k) = (free[a], free[b]);
            let pull = if j >= model { PULL } else { 1e-6 };
            gram.information[(j, k)] + if a == b { damping * gram.information[(j, j)] + pull } else { 0.0 }
        });
        let right = DVector::from_fn(free.len(), |a, _| {
            let j = free[a];
            let held: f64 = (0..m).filter_map(|k| fixed[k].map(|d| gram.information[(j, k)] * d)).sum();
            -gram.gradient[j] - held
        });
        let Some(solution) = matrix.cholesky().map(|c| c.solve(&right)) else { return place.clone() };
        let longest = |a: usize| if free[a] >= model { LONGEST[0] } else { LONGEST[1] };
        let ratio = (0..free.len()).map(|a| solution[a].abs() / longest(a)).fold(1.0, f64::max);
        let mut left = false;
        for (a, &j) in free.iter().enumerate() {
            let [lower, upper] = frame.bounds(j);
            let wanted = x[j] + solution[a] / ratio;
            next[j] = wanted.clamp(lower, upper);
            if next[j] != wanted {
                fixed[j] = Some(next[j] - x[j]);
                left = true;
            }
        }
        if !left || ratio > 1.0 {
            break;
        }
    }
    Place { frame: *frame, x: next }
}

#[cfg(test)]
mod tests;
