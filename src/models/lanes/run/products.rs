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
    /// Numbers in a row of `sums`, and rows: a multiple of [`STRIDE`].
    width: usize,
    /// How far each coordinate is moved; first and behind the last 1.
    steps: Vec<f64>,
    /// One matrix per signal, row by row; only from the diagonal on. What goes beyond the coordinates means nothing.
    sums: [Vec<f64>; SIGNALS],
    /// The differences of a stretch, sample by sample.
    stretch: Vec<f64>,
}

impl<'a> Products<'a> {
    pub fn new(of: &'a Differences) -> Products<'a> {
        let width = (of.steps.len() + 1).next_multiple_of(STRIDE);
        let mut steps = vec![1.0; width];
        steps[1..=of.steps.len()].copy_from_slice(&of.steps);
        let sums = std::array::from_fn(|_| vec![0.0; width * width]);
        Products { of, width, steps, sums, stretch: Vec::new() }
    }

    /// Adds a stretch of all runs.
    pub fn add(&mut self, stretch: &Residuals) {
        let (lanes, width, signals) = (stretch.lanes, self.width, stretch.signals);
        let (first, candidates) = (self.of.first, self.of.steps.len() + 1);
        for (k, sums) in self.sums.iter_mut().enumerate() {
            self.stretch.clear();
            self.stretch.resize(stretch.samples * width, 0.0);
            // Candidates that lie side by side in a block.
            let mut from = 0;
            while from < candidates {
                let (block, lane) = ((first + from) / lanes, (first + from) % lanes);
                let to = candidates.min(from + lanes - lane);
                let rows = stretch.blocks[block].chunks_exact(lanes).skip(k).step_by(signals);
                for (differences, row) in self.stretch.chunks_exact_mut(width).zip(rows) {
                    differences[from..to].iter_mut().zip(&row[lane..]).for_each(|(to, number)| *to = *number);
                }
                from = to;
            }
            // As of runs that fall short nowhere.
            if self.stretch.iter().any(|number| *number != 0.0) {
                Arch::new().dispatch(Add { sums, differences: &mut self.stretch, steps: &self.steps });
            }
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
    /// What the candidates have, sample by sample.
    differences: &'a mut [f64],
    steps: &'a [f64],
}

// Written with vectors, because loops over numbers become vectors of the oldest processor, or none. Every sum goes from sample to sample,
// and no multiplication is fused with an addition, so that every processor gives the same bits.
impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let width = self.steps.len();
        for differences in self.differences.chunks_exact_mut(width) {
            let error = differences[0];
            differences.iter_mut().zip(self.steps).for_each(|(d, step)| *d = (*d - error) / step);
            differences[0] = error;
        }
        let lanes = S::F64_LANES;
        // Tiles of as many sums as stay in registers.
        for (block, rows) in self.sums.chunks_exact_mut(STRIDE * width).enumerate() {
            for column in block * STRIDE / lanes..width / lanes {
                let mut tile = [simd.splat_f64s(0.0); STRIDE];
                for (sums, row) in tile.iter_mut().zip(rows.chunks_exact(width)) {
                    *sums = S::as_simd_f64s(row).0[column];
                }
                for differences in self.differences.chunks_exact(width) {
                    let d_j = S::as_simd_f64s(differences).0[column];
                    for (sums, d_i) in tile.iter_mut().zip(&differences[block * STRIDE..]) {
                        *sums = simd.add_f64s(*sums, simd.mul_f64s(simd.splat_f64s(*d_i), d_j));
                    }
                }
                for (sums, row) in tile.iter().zip(rows.chunks_exact_mut(width)) {
                    S::as_mut_simd_f64s(row).0[column] = *sums;
                }
            }
        }
    }
}
