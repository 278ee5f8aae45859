//! Sums of products of differences, from which the derivatives of a goodness of fit follow.

use super::Slopes;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Numbers per sample that derivatives need: the errors of spacing, speed and acceleration that the goodness of fit squares, and the
/// penalty of a soft run.
pub const SIGNALS: usize = 4;

/// Place of the penalty.
pub(crate) const SHORTFALL: usize = 3;

/// A candidate among those of a run, followed by copies of it with one coordinate moved at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Differences {
    /// Position of the candidate.
    pub first: usize,
    /// Displacement of each coordinate.
    pub steps: Vec<f64>,
}

impl Differences {
    /// Positions of the candidate and its copies.
    pub fn group(&self) -> Range<usize> {
        self.first..self.first + self.steps.len() + 1
    }
}

/// Σ d_i d_j over the samples of a bin: d_0 is the error of the candidate, the others are the errors of its displaced copies minus d_0.
#[derive(Debug, Clone)]
pub struct Products<'a> {
    of: &'a Differences,
    /// Numbers in a row of a matrix of `sums`, and rows.
    width: usize,
    /// One matrix per bin and signal, row by row; only from the diagonal on.
    sums: Vec<f64>,
}

/// The sums of a bin and signal among those of all.
pub(crate) fn place(width: usize, bin: usize, signal: usize) -> Range<usize> {
    let size = width * width;
    let first = (bin * SIGNALS + signal) * size;
    first..first + size
}

impl<'a> Products<'a> {
    /// From [`SIGNALS`] matrices of `width` rows and columns per bin; only the entries of the candidate and its copies count, from the
    /// diagonal on.
    pub(crate) fn new(of: &'a Differences, width: usize, sums: Vec<f64>) -> Products<'a> {
        Products { of, width, sums }
    }

    fn sums(&self, bin: usize, signal: usize) -> &[f64] {
        &self.sums[place(self.width, bin, signal)]
    }

    /// Σ of the squared error of a signal in a bin.
    #[must_use]
    pub fn square(&self, bin: usize, signal: usize) -> f64 {
        self.sums(bin, signal)[0]
    }

    /// Σ of error times derivative, for each moved coordinate.
    #[must_use]
    pub fn half_gradient(&self, bin: usize, signal: usize) -> DVector<f64> {
        let sums = self.sums(bin, signal);
        DVector::from_fn(self.of.steps.len(), |i, _| sums[i + 1] / self.of.steps[i])
    }

    /// Σ of products of derivatives.
    #[must_use]
    pub fn products(&self, bin: usize, signal: usize) -> DMatrix<f64> {
        let (steps, sums) = (&self.of.steps, self.sums(bin, signal));
        let sum = |i: usize, j: usize| sums[(i.min(j) + 1) * self.width + i.max(j) + 1];
        DMatrix::from_fn(steps.len(), steps.len(), |i, j| sum(i, j) / (steps[i] * steps[j]))
    }

    /// `weights`: for each signal, the factor of its root mean square, and one over its number of samples.
    pub(crate) fn slopes(&self, weights: [[f64; 2]; 3], price: f64) -> Slopes {
        let (half, products) = (|k: usize| self.half_gradient(0, k), |k: usize| self.products(0, k));
        let mut slopes = Slopes {
            cost: price * self.square(0, SHORTFALL),
            gradient: half(SHORTFALL) * (2.0 * price),
            curvature: products(SHORTFALL) * (2.0 * price),
            majorant: products(SHORTFALL) * (2.0 * price),
        };
        for (k, [weight, per_count]) in weights.into_iter().enumerate().filter(|(_, w)| w[0] != 0.0) {
            let root = (self.square(0, k) * per_count).sqrt();
            let (half, square) = (half(k) * per_count, products(k) * per_count);
            let root_above_0 = root.max(f64::MIN_POSITIVE.sqrt());
            slopes.cost += weight * root;
            slopes.curvature -= &half * half.transpose() * (weight / root_above_0.powi(3));
            slopes.gradient += half * (weight / root_above_0);
            slopes.curvature += &square * (weight / root_above_0);
            slopes.majorant += square * (weight / root_above_0);
        }
        slopes
    }
}
