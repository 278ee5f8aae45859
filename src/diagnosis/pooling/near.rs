//! A penalty for the distance from a point.

use crate::calibrate::descent;
use crate::evaluator::{Pull, Slopes};

/// A surface plus Σ weight (coordinate - centre)²: the parameters of a driver stay near those of all drivers.
#[derive(Debug)]
pub struct Near<'a, S> {
    /// The surface.
    pub surface: S,
    /// The point.
    pub centre: &'a [f64],
    /// One weight per coordinate.
    pub weights: Vec<f64>,
}

impl<S> Near<'_, S> {
    /// The penalty at a point.
    #[must_use]
    pub fn penalty(&self, place: &[f64]) -> f64 {
        let distances = place.iter().zip(self.centre).zip(&self.weights);
        distances.map(|((x, c), weight)| weight * (x - c).powi(2)).sum()
    }
}

impl<S: descent::Surface> descent::Surface for Near<'_, S> {
    type Error = S::Error;

    fn dimensions(&self) -> usize {
        self.surface.dimensions()
    }

    fn is_logarithm(&self) -> bool {
        self.surface.is_logarithm()
    }

    fn costs(&self, places: &[Vec<f64>], pull: Pull) -> Result<Vec<f64>, S::Error> {
        let costs = self.surface.costs(places, pull)?;
        Ok(costs.iter().zip(places).map(|(cost, place)| cost + self.penalty(place)).collect())
    }

    fn slopes(&self, places: &[&Vec<f64>], held: &[usize], pull: Pull) -> Result<Vec<Slopes>, S::Error> {
        let mut all = self.surface.slopes(places, held, pull)?;
        for (slopes, place) in all.iter_mut().zip(places) {
            for k in (0..place.len()).filter(|k| !held.contains(k)) {
                let (distance, weight) = (place[k] - self.centre[k], self.weights[k]);
                slopes.cost += weight * distance * distance;
                slopes.gradient[k] += 2.0 * weight * distance;
                slopes.curvature[(k, k)] += 2.0 * weight;
                slopes.majorant[(k, k)] += 2.0 * weight;
            }
        }
        Ok(all)
    }
}
