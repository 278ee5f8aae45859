//! A driver's own base law: near the common one, by a penalty for the distance.

use super::fit::{FREE, TOLERANCE, best};
use super::loss::SIGNALS;
use super::surface::Surface;
use crate::calibrate::descent::{Course, Walker, descend};
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::{DiagnoseError, Watching};
use crate::pooling::{Near, SPREAD};

/// Largest number of iterations: a driver's law is near the common one.
const TURNS: usize = 4;
/// Smallest standard deviation, as a share of the axis: a common value of zero has no share.
const LEAST: f64 = 0.01;

/// The driver's own parameters, except those in `held`, near the common ones, on a surface of the driver's parts; `None` if the drives cannot
/// be simulated.
///
/// # Errors
/// [`DiagnoseError::Evaluate`], [`DiagnoseError::Stopped`].
pub fn own_law(
    surface: Surface<'_>,
    common: &[f64],
    held: &[usize],
    watching: &Watching<'_>,
) -> Result<Option<Walker>, DiagnoseError> {
    let near = Near { surface, centre: common, weights: weights(&surface, common) };
    let course = Course { pull: FREE, turns: TURNS, tolerance: TOLERANCE };
    let walkers = descend(&near, vec![common.to_vec()], held, course, &mut &*watching)?;
    watching.go_on()?;
    Ok(best(walkers).into_iter().next())
}

/// Weights of the squared distances: each error of a bin counts as one observation, because errors last for some seconds.
fn weights(surface: &Surface<'_>, common: &[f64]) -> Vec<f64> {
    let counts = surface.sizes.iter().zip(surface.counts);
    let bins: usize = counts.filter(|(_, counts)| **counts).map(|(sizes, _)| sizes.count()).sum();
    let weight = |(axis, common): (&Axis, &f64)| {
        let spread = axis.distance(*common, SPREAD).max(LEAST);
        1.0 / (spread * spread * (SIGNALS * bins.max(1)) as f64)
    };
    surface.model.axes.iter().zip(common).map(weight).collect()
}
