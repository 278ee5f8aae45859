//! First and second derivatives of the likelihood of innovations, from finite differences.
//!
//! Fisher scoring for a Gaussian innovations likelihood: parameters of the model change the innovations, those of the noise also
//! change their covariance, and both are estimated in one step.

use super::observer::{Designed, Noise};
use crate::evaluator::Residuals;
use nalgebra::{DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Half the sum of squares and log-determinants, with gradient and information.
#[derive(Debug, Clone)]
pub struct Gram {
    /// Negative log-likelihood, without the constant.
    pub cost: f64,
    /// Its gradient.
    pub gradient: DVector<f64>,
    /// Fisher's information.
    pub information: DMatrix<f64>,
    /// Samples that count.
    pub samples: usize,
}

/// Negative log-likelihoods of runs, one after the other, over the samples that count; infinite where a run failed.
#[must_use]
pub fn costs_of(runs: &Residuals, observers: &[Designed], mask: &[bool]) -> Vec<f64> {
    let lanes = runs.lanes;
    let of = |(block, observers): (&Vec<f64>, &[Designed])| {
        let whitening: [Vec<f64>; 3] =
            std::array::from_fn(|k| padded(observers.iter().map(|designed| designed.whitening[k]), lanes));
        let squares = Arch::new().dispatch(Squares { block, whitening: &whitening, mask });
        let samples = mask.iter().filter(|counts| **counts).count() as f64;
        let cost = |(squares, designed): (f64, &Designed)| 0.5 * (squares + samples * designed.log_det);
        squares.into_iter().zip(observers).map(cost).collect::<Vec<f64>>()
    };
    let mut costs: Vec<f64> = runs.blocks.par_iter().zip(observers.par_chunks(lanes)).flat_map_iter(of).collect();
    let failed = costs.iter_mut().zip(&runs.failed).filter(|(_, failed)| failed.is_some());
    failed.for_each(|(cost, _)| *cost = f64::INFINITY);
    costs
}

/// So many numbers, zeros at the end.
fn padded(numbers: impl Iterator<Item = f64>, count: usize) -> Vec<f64> {
    numbers.chain(std::iter::repeat(0.0)).take(count).collect()
}

/// Sums of whitened squares of the lanes of a block.
struct Squares<'a> {
    block: &'a [f64],
    whitening: &'a [Vec<f64>; 3],
    mask: &'a [bool],
}

// Written with vectors, for loops over numbers become vectors of the oldest processor, or none. No multiplication is fused with an
// addition, so that every processor gives the same bits.
impl WithSimd for Squares<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
        let lanes = self.whitening[0].len();
        let mut sums = vec![0.0; lanes];
        let [w_11, w_21, w_22] = self.whitening.each_ref().map(|w| vectors::<S>(w));
        for (rows, _) in self.block.chunks_exact(2 * lanes).zip(self.mask).filter(|(_, counts)| **counts) {
            let (r_s, r_v) = rows.split_at(lanes);
            let (r_s, r_v) = (vectors::<S>(r_s), vectors::<S>(r_v));
            for (i, sum) in S::as_mut_simd_f64s(&mut sums).0.iter_mut().enumerate() {
                let z_1 = simd.mul_f64s(w_11[i], r_s[i]);
                let z_2 = simd.add_f64s(simd.mul_f64s(w_21[i], r_s[i]), simd.mul_f64s(w_22[i], r_v[i]));
                *sum = simd.add_f64s(*sum, simd.add_f64s(simd.mul_f64s(z_1, z_1), simd.mul_f64s(z_2, z_2)));
            }
        }
        sums
    }
}

/// A row as vectors.
///
/// # Panics
/// If numbers are left over: rows are multiples of [`Residuals::STRIDE`], the widest vector.
#[inline(always)]
fn vectors<S: Simd>(row: &[f64]) -> &[S::f64s] {
    let (vectors, rest) = S::as_simd_f64s(row);
    assert!(rest.is_empty(), "rows of whole vectors");
    vectors
}

/// The columns of a Gram matrix: the runs that follow a run, each with one coordinate a step further.
struct Columns<'a> {
    runs: &'a Residuals,
    first: usize,
    /// What whitens a change and divides it by its step; zeros for runs that failed.
    scale: [Vec<f64>; 3],
    /// Columns whose runs failed.
    failed: Vec<usize>,
    /// Block, lane, column, count: where the runs lie.
    places: Vec<[usize; 4]>,
    /// Columns, and the innovations themselves, up to a multiple of the stride.
    width: usize,
}

impl Columns<'_> {
    fn new<'a>(runs: &'a Residuals, first: usize, observers: &[Designed], steps: &[f64]) -> Columns<'a> {
        let m = steps.len();
        let width = (m + 1).next_multiple_of(Residuals::STRIDE);
        let runs_on = |j: &usize| runs.failed[first + 1 + j].is_none();
        let scale = |k: usize| {
            let of = |j: usize| if runs_on(&j) { observers[1 + j].whitening[k] / steps[j] } else { 0.0 };
            padded((0..m).map(of), width)
        };
        let mut places: Vec<[usize; 4]> = Vec::new();
        for j in 0..m {
            let (block, lane) = ((first + 1 + j) / runs.lanes, (first + 1 + j) % runs.lanes);
            match places.last_mut() {
                Some(place) if place[0] == block => place[3] += 1,
                _ => places.push([block, lane, j, 1]),
            }
        }
        let failed = (0..m).filter(|j| !runs_on(j)).collect();
        Columns { runs, first, scale: [scale(0), scale(1), scale(2)], failed, places, width }
    }
}

/// Lower triangle of the products of all columns, the last of which are the innovations; and those of the innovations signal by signal.
struct Products<'a> {
    columns: &'a Columns<'a>,
    designed: &'a Designed,
    mask: &'a [bool],
}

impl WithSimd for Products<'_> {
    type Output = (Vec<f64>, [[f64; 2]; 2]);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Columns { runs, first, width, .. } = *self.columns;
        let (lanes, m) = (runs.lanes, self.columns.places.iter().map(|place| place[3]).sum::<usize>());
        let mut products = vec![0.0; width * width];
        let mut outer = [[0.0; 2]; 2];
        let (mut r_s, mut r_v) = (vec![0.0; width], vec![0.0; width]);
        let (mut z_1, mut z_2) = (vec![0.0; width], vec![0.0; width]);
        let [w_11, w_21, w_22] = self.columns.scale.each_ref().map(|w| vectors::<S>(w));
        for (t, _) in self.mask.iter().enumerate().take(runs.samples).filter(|(_, counts)| **counts) {
            for &[block, lane, column, count] in &self.columns.places {
                let at = 2 * t * lanes + lane;
                r_s[column..column + count].copy_from_slice(&runs.blocks[block][at..at + count]);
                r_v[column..column + count].copy_from_slice(&runs.blocks[block][at + lanes..at + lanes + count]);
            }
            for &column in &self.columns.failed {
                (r_s[column], r_v[column]) = (0.0, 0.0);
            }
            let at = 2 * t * lanes + first % lanes;
            let r = [runs.blocks[first / lanes][at], runs.blocks[first / lanes][at + lanes]];
            let (now_s, now_v) = (simd.splat_f64s(r[0]), simd.splat_f64s(r[1]));
            let (moved_s, moved_v) = (vectors::<S>(&r_s), vectors::<S>(&r_v));
            let whitened = S::as_mut_simd_f64s(&mut z_1).0.iter_mut().zip(S::as_mut_simd_f64s(&mut z_2).0);
            for (j, (z_1, z_2)) in whitened.enumerate() {
                let (d_s, d_v) = (simd.sub_f64s(moved_s[j], now_s), simd.sub_f64s(moved_v[j], now_v));
                *z_1 = simd.mul_f64s(w_11[j], d_s);
                *z_2 = simd.add_f64s(simd.mul_f64s(w_21[j], d_s), simd.mul_f64s(w_22[j], d_v));
            }
            let z = self.designed.white(r);
            (z_1[m], z_2[m]) = (z[0], z[1]);
            for (i, z_i) in z.iter().enumerate() {
                outer[i][0] += z_i * z[0];
                outer[i][1] += z_i * z[1];
            }
            for (j, line) in products.chunks_exact_mut(width).take(m + 1).enumerate() {
                let (a, b) = (simd.splat_f64s(z_1[j]), simd.splat_f64s(z_2[j]));
                // Up to the diagonal, and to the end of its vector.
                let upto = (j + 1).next_multiple_of(Residuals::STRIDE);
                let (z_1, z_2) = (vectors::<S>(&z_1[..upto]), vectors::<S>(&z_2[..upto]));
                for (k, sum) in S::as_mut_simd_f64s(&mut line[..upto]).0.iter_mut().enumerate() {
                    let product = simd.add_f64s(simd.mul_f64s(a, z_1[k]), simd.mul_f64s(b, z_2[k]));
                    *sum = simd.add_f64s(*sum, product);
                }
            }
        }
        (products, outer)
    }
}

impl Gram {
    /// Of nothing.
    #[must_use]
    pub fn zero(coordinates: usize) -> Gram {
        let (gradient, information) = (DVector::zeros(coordinates), DMatrix::zeros(coordinates, coordinates));
        Gram { cost: 0.0, gradient, information, samples: 0 }
    }

    /// Adds one drive: the run `first` with the observer that comes first, followed by those with one coordinate a step further; the
    /// last [`Noise::COUNT`] coordinates are those of the noise.
    pub fn add(&mut self, runs: &Residuals, first: usize, observers: &[Designed], steps: &[f64], mask: &[bool]) {
        let (m, designed) = (steps.len(), &observers[0]);
        let first_noise = m - Noise::COUNT;
        let columns = Columns::new(runs, first, observers, steps);
        let (products, outer) = Arch::new().dispatch(Products { columns: &columns, designed, mask });
        let width = columns.width;
        let samples = mask.iter().take(runs.samples).filter(|counts| **counts).count();
        let n = samples as f64;
        self.samples += samples;
        self.cost += 0.5 * (outer[0][0] + outer[1][1] + n * designed.log_det);
        for j in 0..m {
            self.gradient[j] += products[m * width + j];
            for k in 0..=j {
                self.information[(j, k)] += products[j * width + k];
                if k < j {
                    self.information[(k, j)] += products[j * width + k];
                }
            }
        }
        // What the noise does to the covariance: dW W^-1, lower triangular.
        let noise = || observers[1 + first_noise..].iter().zip(&steps[first_noise..]);
        let relative: Vec<[f64; 3]> = noise().map(|(moved, step)| relative(designed, moved, *step)).collect();
        for (j, (a, (moved, step))) in relative.iter().zip(noise()).enumerate() {
            let log_det = (moved.log_det - designed.log_det) / step;
            self.gradient[first_noise + j] +=
                a[0] * outer[0][0] + a[1] * outer[1][0] + a[2] * outer[1][1] + 0.5 * n * log_det;
            for (k, b) in relative.iter().enumerate() {
                let trace = 4.0 * (a[0] * b[0] + a[2] * b[2]) + 2.0 * a[1] * b[1];
                self.information[(first_noise + j, first_noise + k)] += 0.5 * n * trace;
            }
        }
    }
}

/// dW W^-1 per step: places 11, 21 and 22.
fn relative(designed: &Designed, moved: &Designed, step: f64) -> [f64; 3] {
    let [w_11, w_21, w_22] = designed.whitening;
    let mut change = moved.whitening;
    change.iter_mut().zip(designed.whitening).for_each(|(new, old)| *new = (*new - old) / step);
    let [d_11, d_21, d_22] = change;
    [d_11 / w_11, (d_21 - d_22 * w_21 / w_22) / w_11, d_22 / w_22]
}
