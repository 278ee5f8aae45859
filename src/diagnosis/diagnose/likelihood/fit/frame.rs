//! The coordinates of a fit: parameters of the model scaled to 0..1, then logarithms of the noise.

use super::Point;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::likelihood::space::Axis;
use nalgebra::{DMatrix, DVector};

/// Bounds of the noise: missing acceleration as growth of a speed error \[(m/s)/s^0.5\], its time constant \[s\], noise of spacing
/// \[m\], speed and leader \[m/s\]. In these coordinates the bounds are a box.
const NOISE_BOUNDS: [[f64; 2]; Noise::COUNT] = [[SCHEME, 5.0], [0.15, 120.0], [1e-5, 2.0], [1e-5, 2.0], [1e-6, 0.3]];
/// Smallest missing acceleration \[(m/s)/s^0.5\], as growth of a speed error: no scheme with steps of a tenth of a second is closer to a
/// car. With less, a nearly complete model becomes a free simulation, and a cause can explain the error of the scheme.
const SCHEME: f64 = 0.01;
/// Step of a finite difference in the logarithm of a noise level.
const LOG_STEP: f64 = 1e-4;
/// A prior on the coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// Coordinates 0..1 of the parameters, then logarithms of the noise.
    pub centre: Vec<f64>,
    /// Information matrix of the prior.
    pub information: DMatrix<f64>,
}

/// The axes of the model, followed by the logarithms of the noise, of which the first is sigma_d sqrt(2 tau_d).
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame<'a> {
    pub axes: &'a [Axis],
    pub prior: Option<&'a Prior>,
    /// Smallest noise of spacing and speed \[m, m/s\]; 0: that of [`NOISE_BOUNDS`].
    pub least: [f64; 2],
}

impl<'a> Frame<'a> {
    pub fn place(self, point: &Point) -> Place<'a> {
        Place { frame: self, x: self.of(point) }
    }

    pub fn coordinates(&self) -> usize {
        self.axes.len() + Noise::COUNT
    }

    pub fn of(&self, point: &Point) -> Vec<f64> {
        let model = self.axes.iter().zip(&point.values).map(|(axis, value)| axis.coordinate(*value));
        let mut noise = point.noise.logs();
        noise[0] += 0.5 * (2.0 * point.noise.tau_d).ln();
        let within = |k: usize| noise[k].clamp(self.noise_bounds(k)[0], self.noise_bounds(k)[1]);
        model.chain((0..Noise::COUNT).map(within)).collect()
    }

    /// Bounds of a coordinate of the noise.
    fn noise_bounds(&self, k: usize) -> [f64; 2] {
        let [lower, upper] = NOISE_BOUNDS[k];
        let least = if k == 2 || k == 3 { self.least[k - 2] } else { 0.0 };
        [lower.max(least).ln(), upper.ln()]
    }

    pub fn off(&self, prior: &Prior, x: &[f64]) -> DVector<f64> {
        DVector::from_fn(
            x.len(),
            |j, _| if self.bounds(j)[0] < self.bounds(j)[1] { x[j] - prior.centre[j] } else { 0.0 },
        )
    }

    /// The cost of the prior.
    pub fn penalty(&self, x: &[f64]) -> f64 {
        self.prior.map_or(0.0, |prior| {
            let off = self.off(prior, x);
            0.5 * off.dot(&(&prior.information * &off))
        })
    }

    pub fn point(&self, x: &[f64]) -> Point {
        let (model, noise) = x.split_at(self.axes.len());
        let values = self.axes.iter().zip(model).map(|(axis, u)| axis.value(*u)).collect();
        let mut noise = Noise::from_logs(std::array::from_fn(|i| noise[i]));
        noise.sigma_d /= (2.0 * noise.tau_d).sqrt();
        Point { values, noise }
    }

    pub fn bounds(&self, j: usize) -> [f64; 2] {
        match j.checked_sub(self.axes.len()) {
            None if self.axes[j].is_fixed() => [0.0, 0.0],
            None => [0.0, 1.0],
            Some(k) => self.noise_bounds(k),
        }
    }

    /// True for a coordinate without a derivative.
    pub fn is_held(&self, j: usize) -> bool {
        self.axes.get(j).is_some_and(Axis::is_held)
    }

    /// The step of a finite difference, inwards at the upper bound.
    pub fn step(&self, j: usize, x: f64) -> f64 {
        let size = self.axes.get(j).map_or(LOG_STEP, |axis| axis.step);
        if x + size > self.bounds(j)[1] { -size } else { size }
    }
}

/// Coordinates in their frame: 0..1 of the model, then logarithms of the noise.
#[derive(Debug, Clone)]
pub(super) struct Place<'a> {
    pub frame: Frame<'a>,
    pub x: Vec<f64>,
}

impl Place<'_> {
    /// Logarithms of the noise, which define the observer.
    pub fn noise(&self) -> &[f64] {
        &self.x[self.frame.axes.len()..]
    }

    pub fn point(&self) -> Point {
        self.frame.point(&self.x)
    }

    /// The point one finite difference further in a coordinate.
    pub fn moved(&self, j: usize) -> Self {
        let mut moved = self.clone();
        moved.x[j] += self.frame.step(j, self.x[j]);
        moved
    }
}

/// Covariance in coordinates; the variance is infinite for coordinates that are fixed or that the data do not determine.
pub(super) fn inverse(frame: &Frame<'_>, information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let m = frame.coordinates();
    let free: Vec<usize> =
        (0..m).filter(|&j| information[(j, j)] > 1e-9 && frame.bounds(j)[0] < frame.bounds(j)[1]).collect();
    let scale: Vec<f64> = free.iter().map(|&j| information[(j, j)].sqrt()).collect();
    let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        information[(free[a], free[b])] / (scale[a] * scale[b]) + if a == b { 1e-10 } else { 0.0 }
    });
    let small = scaled.cholesky()?.inverse();
    let mut whole = DMatrix::from_diagonal_element(m, m, f64::INFINITY);
    for (a, &j) in free.iter().enumerate() {
        whole[(j, j)] = small[(a, a)] / (scale[a] * scale[a]);
    }
    Some(whole)
}
