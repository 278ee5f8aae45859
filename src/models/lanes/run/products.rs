//! Sums of products of differences: what the derivatives of a goodness of fit are made of.

use super::sums::SIGNALS;
use crate::evaluator::{Residuals, Slopes};
use nalgebra::{DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

/// A candidate among those of a run, followed by itself with one coordinate moved at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Differences {
    /// Where the candidate is.
    pub first: usize,
    /// How far each coordinate is moved.
    pub steps: Vec<f64>,
}

/// Numbers of the widest vector.
const STRIDE: usize = 8;

/// Σ d_i d_j over the samples of a run: d_0 is the error of the candidate, d_1 and on its derivatives.
#[derive(Debug)]
pub(super) struct Products<'a> {
    of: &'a Differences,
    /// Numbers in a row of `sums`, a multiple of [`STRIDE`].
    width: usize,
    /// One matrix per signal, row by row; only from the diagonal on.
    sums: [Vec<f64>; SIGNALS],
    /// The differences of a stretch, sample by sample.
    stretch: Vec<f64>,
}

impl<'a> Products<'a> {
    pub fn new(of: &'a Differences) -> Products<'a> {
        let width = (of.steps.len() + 1).next_multiple_of(STRIDE);
        let sums = std::array::from_fn(|_| vec![0.0; (of.steps.len() + 1) * width]);
        Products { of, width, sums, stretch: Vec::new() }
    }

    /// Adds a stretch of all runs.
    pub fn add(&mut self, stretch: &Residuals) {
        let (lanes, width, signals) = (stretch.lanes, self.width, stretch.signals);
        for (k, sums) in self.sums.iter_mut().enumerate() {
            self.stretch.clear();
            self.stretch.resize(stretch.samples * width, 0.0);
            for i in 0..=self.of.steps.len() {
                let candidate = self.of.first + i;
                let (block, lane) = (&stretch.blocks[candidate / lanes], candidate % lanes);
                let numbers = block.chunks_exact(lanes).skip(k).step_by(signals).map(|row| row[lane]);
                for (difference, number) in self.stretch.chunks_exact_mut(width).zip(numbers) {
                    difference[i] = number;
                }
            }
            for differences in self.stretch.chunks_exact_mut(width) {
                let error = differences[0];
                for (difference, step) in differences[1..].iter_mut().zip(&self.of.steps) {
                    *difference = (*difference - error) / step;
                }
            }
            Arch::new().dispatch(Add { sums, differences: &self.stretch, width });
        }
    }

    /// `weights`: of each signal, the factor of its root mean square, and one over the number of samples in it.
    pub fn slopes(&self, weights: [[f64; 2]; 3], price: f64) -> Slopes {
        let n = self.of.steps.len();
        let at = |k: usize, i: usize, j: usize| self.sums[k][i.min(j) * self.width + i.max(j)];
        let half = |k: usize| DVector::from_fn(n, |i, _| at(k, 0, i + 1));
        let square = |k: usize| DMatrix::from_fn(n, n, |i, j| at(k, i + 1, j + 1));
        let mut slopes = Slopes {
            cost: price * at(3, 0, 0),
            gradient: half(3) * (2.0 * price),
            curvature: square(3) * (2.0 * price),
            majorant: square(3) * (2.0 * price),
        };
        for (k, [weight, per_count]) in weights.into_iter().enumerate().filter(|(_, w)| w[0] != 0.0) {
            let root = (at(k, 0, 0) * per_count).sqrt();
            let (half, square) = (half(k) * per_count, square(k) * per_count);
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

/// Adds the products of the differences of a stretch.
struct Add<'a> {
    sums: &'a mut [f64],
    differences: &'a [f64],
    width: usize,
}

// Written with vectors, because loops over numbers become vectors of the oldest processor, or none. Every sum goes from sample to sample,
// and no multiplication is fused with an addition, so that every processor gives the same bits.
impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for differences in self.differences.chunks_exact(self.width) {
            for (i, (sums, d_i)) in self.sums.chunks_exact_mut(self.width).zip(differences).enumerate() {
                let from = i / STRIDE * STRIDE;
                let d_i = simd.splat_f64s(*d_i);
                let (sums, _) = S::as_mut_simd_f64s(&mut sums[from..]);
                let (d, _) = S::as_simd_f64s(&differences[from..]);
                for (sum, d_j) in sums.iter_mut().zip(d) {
                    *sum = simd.add_f64s(*sum, simd.mul_f64s(d_i, *d_j));
                }
            }
        }
    }
}
