//! A search without derivatives, for sizes on which innovations depend in jumps.

use super::fit::{Point, log_likelihoods};
use super::model::Model;
use super::robust::Mask;
use super::space::Axis;
use super::streams;
use crate::diagnose::question::DiagnoseError;
use crate::optimize::{Descent, DescentSettings, Merit, Optimizer, Origin, SearchBox, Start};

/// Evaluations and population of a run of CMA-ES.
const DESCENT: (u64, usize) = (3000, 50);

/// The best point that CMA-ES finds around a point, along the axes that are not fixed, with fixed noise, on the samples of the masks.
/// `step` is its first step as a share of the ranges. Each `turn` of a `seed` draws its own random numbers. `None` if no run is complete.
///
/// # Errors
/// As [`log_likelihoods`].
pub fn descended(
    model: &Model,
    axes: &[Axis],
    masks: &[Mask],
    at: &Point,
    step: f64,
    (seed, turn): (u64, u64),
) -> Result<Option<Point>, DiagnoseError> {
    let free: Vec<usize> = (0..axes.len()).filter(|&k| !axes[k].is_fixed()).collect();
    let point = |coordinates: &[f64]| {
        let mut values = at.values.clone();
        free.iter().zip(coordinates).for_each(|(&k, u)| values[k] = axes[k].value(*u));
        Point { values, noise: at.noise }
    };
    let space = SearchBox { lower: vec![0.0; free.len()], upper: vec![1.0; free.len()] };
    let middle = free.iter().map(|&k| axes[k].coordinate(at.values[k])).collect();
    let settings = DescentSettings { population: DESCENT.1, evaluations: DESCENT.0, tolerance: 1e-7, floor: 0.0 };
    let origin = Origin { generation: 1000 * turn, ..Origin::new(seed, streams::DESCENT) };
    let mut descent = Descent::new(space, Start::Round { middle, step }, settings, origin);
    while descent.ended().is_none() {
        let points: Vec<Point> = descent.ask().iter().map(|coordinates| point(coordinates)).collect();
        let merit = |likelihood: f64| match likelihood.is_finite() {
            true => Merit::Feasible(-likelihood),
            false => Merit::Infeasible { survived: 0 },
        };
        let likelihoods = log_likelihoods(model, axes, masks, &points)?;
        descent.tell(&likelihoods.into_iter().map(merit).collect::<Vec<_>>());
    }
    let best = descent.best().filter(|best| matches!(best.merit, Merit::Feasible(_)));
    Ok(best.map(|best| point(&best.point)))
}
