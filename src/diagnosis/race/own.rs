//! A driver's own base law: near the middle of all drivers, by a penalty for the distance.

use super::fit::{FREE, TOLERANCE};
use super::loss::{Losses, SIGNALS};
use super::surface::Surface;
use crate::calibrate::descent::{Course, Surface as _, Walker, descend, merged};
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::{DiagnoseError, Watching};
use crate::pooling::Near;
use nalgebra::DMatrix;

/// Largest number of iterations: a driver's law is near the middle.
const TURNS: usize = 4;
/// Smallest standard deviation, as a share of the axis: a value of zero has no share.
const LEAST: f64 = 0.01;

/// Independent errors of a signal in a bin of 10 s: errors last for about five seconds.
const IN_A_BIN: f64 = 2.0;

/// The weight of the mean logarithm of the squared errors in a logarithm of the likelihood: half the number of independent errors.
#[must_use]
pub fn weight(bins: usize) -> f64 {
    0.5 * IN_A_BIN * (SIGNALS * bins.max(1)) as f64
}

/// The own parameters of a driver.
pub struct OwnLaw<'a> {
    near: Near<'a, Surface<'a>>,
    held: &'a [usize],
    /// See [`weight`].
    weight: f64,
}

impl<'a> OwnLaw<'a> {
    /// Those of the driver whose parts count, except `held`, near a middle with this standard deviation (a share of the value).
    #[must_use]
    pub fn new(surface: Surface<'a>, (middle, spread): (&'a [f64], f64), held: &'a [usize]) -> OwnLaw<'a> {
        let weight = weight(surface.bins());
        let of = |(axis, middle): (&Axis, &f64)| {
            let spread = axis.distance(*middle, spread).max(LEAST);
            0.5 / (spread * spread * weight)
        };
        let weights = surface.model.axes.iter().zip(middle).map(of).collect();
        OwnLaw { near: Near { surface, centre: middle, weights }, held, weight }
    }

    /// The best parameters; `None` if the drives cannot be simulated.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`], [`DiagnoseError::Stopped`].
    pub fn found(&self, watching: &Watching<'_>) -> Result<Option<Walker>, DiagnoseError> {
        let course = Course { pull: FREE, turns: TURNS, tolerance: TOLERANCE };
        let walkers = descend(&self.near, vec![self.near.centre.to_vec()], self.held, course, &mut &*watching)?;
        watching.go_on()?;
        Ok(merged(walkers).into_iter().next())
    }

    /// The best parameters with their losses; `None` if the drives cannot be simulated.
    ///
    /// The losses are those of the marginal likelihood (by the method of Laplace): parameters that are fitted to the driver who is judged
    /// have a price, so that a law does not gain by their number.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`], [`DiagnoseError::Stopped`].
    pub fn judged(&self, watching: &Watching<'_>) -> Result<Option<(f64, Losses)>, DiagnoseError> {
        let Some(Walker { place, cost, .. }) = self.found(watching)? else { return Ok(None) };
        let weights = &self.near.weights;
        let curvature = self.near.slopes(&[&place], self.held, FREE)?.remove(0).curvature;
        let free: Vec<usize> = (0..place.len()).filter(|k| !self.held.contains(k)).collect();
        let relative = |i: usize, j: usize| {
            let (k, l) = (free[i], free[j]);
            curvature[(k, l)] / (2.0 * (weights[k] * weights[l]).sqrt())
        };
        // Information on the parameters from the drives and the middle, relative to that from the middle alone.
        let information = DMatrix::from_fn(free.len(), free.len(), relative).determinant();
        let price = 0.5 * information.max(1.0).ln() / self.weight;
        let mut losses = self.near.surface.losses(&[self.near.surface.values(&place)])?.remove(0);
        losses.parts.iter_mut().flatten().for_each(|part| part.add(self.near.penalty(&place) + price));
        Ok(Some((cost + price, losses)))
    }
}
