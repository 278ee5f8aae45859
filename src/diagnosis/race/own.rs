//! A driver's own base law: near the common one, by a penalty for the distance.

use super::fit::{FREE, TOLERANCE, best};
use super::loss::SIGNALS;
use super::surface::Surface;
use crate::calibrate::descent;
use crate::calibrate::descent::{Course, Walker, descend};
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::{DiagnoseError, Watching};
use crate::evaluator::{Pull, Slopes};

/// Largest number of iterations: a driver's law is near the common one.
const TURNS: usize = 4;
/// Standard deviation of a parameter over drivers, as a share of the common value: headways of human drivers differ by about a third.
const SPREAD: f64 = 0.35;
/// Smallest standard deviation, as a share of the axis: a common value of zero has no share.
const LEAST: f64 = 0.01;

/// The loss of one driver with a penalty for the distance from the common parameters.
#[derive(Debug)]
pub struct Own<'a> {
    /// The loss on the parts of the driver.
    pub surface: Surface<'a>,
    /// The common parameters.
    pub common: &'a [f64],
}

impl Own<'_> {
    /// The driver's own parameters, except those in `held`; `None` if the drives cannot be simulated.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`], [`DiagnoseError::Stopped`].
    pub fn descend(&self, held: &[usize], watching: &Watching<'_>) -> Result<Option<Walker>, DiagnoseError> {
        let course = Course { pull: FREE, turns: TURNS, tolerance: TOLERANCE };
        let walkers = descend(self, vec![self.common.to_vec()], held, course, &mut &*watching)?;
        watching.go_on()?;
        Ok(best(walkers).into_iter().next())
    }

    /// Weights of the squared distances: each error of a bin counts as one observation, because errors last for some seconds.
    fn weights(&self) -> Vec<f64> {
        let counts = self.surface.sizes.iter().zip(self.surface.counts);
        let bins: usize = counts.filter(|(_, counts)| **counts).map(|(sizes, _)| sizes.count()).sum();
        let weight = |(axis, common): (&Axis, &f64)| {
            let value = axis.value(*common);
            let spread = [1.0 - SPREAD, 1.0 + SPREAD].map(|factor| (axis.coordinate(factor * value) - common).abs());
            let spread = spread[0].max(spread[1]).max(LEAST);
            1.0 / (spread * spread * (SIGNALS * bins.max(1)) as f64)
        };
        self.surface.model.axes.iter().zip(self.common).map(weight).collect()
    }
}

impl descent::Surface for Own<'_> {
    type Error = DiagnoseError;

    fn dimensions(&self) -> usize {
        self.surface.dimensions()
    }

    fn costs(&self, places: &[Vec<f64>], pull: Pull) -> Result<Vec<f64>, DiagnoseError> {
        let weights = self.weights();
        let penalty = |place: &Vec<f64>| {
            place.iter().zip(self.common).zip(&weights).map(|((x, c), weight)| weight * (x - c).powi(2)).sum::<f64>()
        };
        let costs = self.surface.costs(places, pull)?;
        Ok(costs.iter().zip(places).map(|(cost, place)| cost + penalty(place)).collect())
    }

    fn slopes(&self, places: &[&Vec<f64>], held: &[usize], pull: Pull) -> Result<Vec<Slopes>, DiagnoseError> {
        let mut all = self.surface.slopes(places, held, pull)?;
        let weights = self.weights();
        for (slopes, place) in all.iter_mut().zip(places) {
            for k in (0..place.len()).filter(|k| !held.contains(k)) {
                let (distance, weight) = (place[k] - self.common[k], weights[k]);
                slopes.cost += weight * distance * distance;
                slopes.gradient[k] += 2.0 * weight * distance;
                slopes.curvature[(k, k)] += 2.0 * weight;
                slopes.majorant[(k, k)] += 2.0 * weight;
            }
        }
        Ok(all)
    }
}
