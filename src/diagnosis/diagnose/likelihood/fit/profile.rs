//! The gain of a change of a model when all other parameters move with it: one step of Fisher scoring along each of many changes at once,
//! because they share the runs that move the other parameters.

use super::drives::{BATCH, on_all};
use super::frame::Frame;
use super::{LONGEST, PULL, Point, Predictor};
use crate::diagnose::likelihood::normal_equations::{NormalEquations, Products};
use crate::diagnose::likelihood::observer::{KalmanGain, Noise, design};
use crate::diagnose::likelihood::robust::Mask;
use crate::diagnose::likelihood::space::Axis;
use nalgebra::{DMatrix, DVector};

/// Result of a step along a change.
#[derive(Debug, Clone, PartialEq)]
pub struct Profiled {
    /// Predicted gain over moving the other parameters alone \[nats\].
    pub gain: f64,
    /// Multiple of the change.
    pub share: f64,
    /// The parameters there, without the change.
    pub values: Vec<f64>,
}

/// Largest multiple of a change, in either direction.
const MOST: f64 = 4.0;

/// A step from a point along each of several changes of its values; `changed` holds the changed values.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn profiled<P: Predictor>(
    predictor: &P,
    axes: &[Axis],
    masks: &[Mask],
    at: &Point,
    changed: &[Vec<f64>],
) -> Result<Vec<Profiled>, P::Error> {
    let frame = Frame { axes, prior: None, least: [0.0; 2] };
    let mut found = Vec::with_capacity(changed.len());
    for changed in changed.chunks(BATCH) {
        let gram = derivatives(predictor, &frame, masks, at, changed)?;
        found.extend(steps(&frame, &frame.of(at), &gram, changed.len()));
    }
    Ok(found)
}

/// Derivatives in the coordinates of the model, along the changes, and in the coordinates of the noise.
fn derivatives<P: Predictor>(
    predictor: &P,
    frame: &Frame<'_>,
    masks: &[Mask],
    at: &Point,
    changed: &[Vec<f64>],
) -> Result<NormalEquations, P::Error> {
    let (model, all) = (frame.axes.len(), frame.coordinates());
    let x = frame.of(at);
    let size = |j: usize| frame.step(j, x[j]);
    let moved = |j: usize| {
        let mut moved = x.clone();
        moved[j] += size(j);
        frame.point(&moved)
    };
    let along = changed.iter().map(|values| Point { values: values.clone(), noise: at.noise });
    let points: Vec<Point> =
        std::iter::once(at.clone()).chain((0..model).map(moved)).chain(along).chain((model..all).map(moved)).collect();
    let sizes: Vec<f64> =
        (0..model).map(size).chain(changed.iter().map(|_| 1.0)).chain((model..all).map(size)).collect();
    let values: Vec<Vec<f64>> = points.iter().map(|point| point.values.clone()).collect();
    let mut gram = NormalEquations::zero(sizes.len());
    let coordinates: Vec<usize> = (0..sizes.len()).collect();
    let of = |drive: usize, dt: f64, mask| {
        let observers: Vec<KalmanGain> = points.iter().map(|point| design(&point.noise, dt)).collect();
        let mut products = Products::new(0, observers.clone(), sizes.clone(), mask);
        let failed = predictor.residuals(drive, &values, &observers, &mut |stretch| products.add(stretch))?;
        Ok((products, failed))
    };
    for (products, failed) in on_all(predictor, masks, of)? {
        gram.add(&products, &coordinates, &failed);
    }
    Ok(gram)
}

/// The resulting steps; none promises a gain if the system for the rest has no solution.
fn steps(frame: &Frame<'_>, x: &[f64], gram: &NormalEquations, count: usize) -> Vec<Profiled> {
    let model = frame.axes.len();
    // The rest: free parameters, and the noise, which follows the changes.
    let rest: Vec<usize> = (0..model).filter(|&j| !frame.axes[j].is_fixed()).collect();
    let free = rest.len();
    let rest: Vec<usize> = rest.into_iter().chain(model + count..model + count + Noise::COUNT).collect();
    let matrix = DMatrix::from_fn(rest.len(), rest.len(), |a, b| {
        let pull = if a >= free { PULL } else { 1e-6 };
        gram.information[(rest[a], rest[b])] + if a == b { pull } else { 0.0 }
    });
    let nothing = Profiled { gain: 0.0, share: 0.0, values: frame.point(x).values };
    let Some(solver) = matrix.cholesky() else { return vec![nothing; count] };
    let gradient = DVector::from_fn(rest.len(), |a, _| gram.gradient[rest[a]]);
    let alone = solver.solve(&gradient);
    let step = |c: usize| {
        let mixed = DVector::from_fn(rest.len(), |a, _| gram.information[(rest[a], model + c)]);
        let with = solver.solve(&mixed);
        let slope = gram.gradient[model + c] - mixed.dot(&alone);
        let bend = gram.information[(model + c, model + c)] - mixed.dot(&with);
        if !(bend.is_finite() && bend > 1e-9) {
            return nothing.clone();
        }
        let share = (-slope / bend).clamp(-MOST, MOST);
        let moves = -(&alone + &with * share);
        let ratio = (0..free).map(|a| moves[a].abs() / LONGEST[1]).fold(1.0, f64::max);
        let mut next = x.to_vec();
        for (a, &j) in rest.iter().enumerate().take(free) {
            next[j] = (x[j] + moves[a] / ratio).clamp(0.0, 1.0);
        }
        Profiled { gain: -slope * share - 0.5 * bend * share * share, share, values: frame.point(&next).values }
    };
    (0..count).map(step).collect()
}
