//! First and second derivatives of the likelihood of innovations, from finite differences.
//!
//! Fisher scoring for a Gaussian innovations likelihood: parameters of the model change the innovations, those of the noise also
//! change their covariance, and both are estimated in one step.

use super::observer::{Designed, Noise};
use crate::evaluator::Residuals;
use nalgebra::{DMatrix, DVector};
use pulp::Arch;
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
        let squares = Arch::new().dispatch(|| squares(block, &whitening, mask));
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
#[inline(always)]
fn squares(block: &[f64], whitening: &[Vec<f64>; 3], mask: &[bool]) -> Vec<f64> {
    let lanes = whitening[0].len();
    let mut sums = vec![0.0; lanes];
    let [w_11, w_21, w_22] = whitening.each_ref().map(|w| &w[..lanes]);
    for (rows, _) in block.chunks_exact(2 * lanes).zip(mask).filter(|(_, counts)| **counts) {
        let (r_s, r_v) = rows.split_at(lanes);
        for i in 0..lanes {
            let z = [w_11[i] * r_s[i], w_21[i] * r_s[i] + w_22[i] * r_v[i]];
            sums[i] += z[0] * z[0] + z[1] * z[1];
        }
    }
    sums
}

/// Numbers that are added up at once.
const STRIDE: usize = 8;

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
        let width = (m + 1).next_multiple_of(STRIDE);
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

    /// Lower triangle of the products of all columns, the last of which are the innovations; and those of the innovations
    /// signal by signal.
    #[inline(always)]
    fn products(&self, designed: &Designed, mask: &[bool]) -> (Vec<f64>, [[f64; 2]; 2]) {
        let Columns { runs, first, width, .. } = *self;
        let (lanes, m) = (runs.lanes, self.places.iter().map(|place| place[3]).sum::<usize>());
        let mut products = vec![0.0; width * width];
        let mut outer = [[0.0; 2]; 2];
        let (mut r_s, mut r_v) = (vec![0.0; width], vec![0.0; width]);
        let (mut z_1, mut z_2) = (vec![0.0; width], vec![0.0; width]);
        let [w_11, w_21, w_22] = self.scale.each_ref().map(|w| &w[..width]);
        for (t, _) in mask.iter().enumerate().take(runs.samples).filter(|(_, counts)| **counts) {
            for &[block, lane, column, count] in &self.places {
                let at = 2 * t * lanes + lane;
                r_s[column..column + count].copy_from_slice(&runs.blocks[block][at..at + count]);
                r_v[column..column + count].copy_from_slice(&runs.blocks[block][at + lanes..at + lanes + count]);
            }
            for &column in &self.failed {
                (r_s[column], r_v[column]) = (0.0, 0.0);
            }
            let at = 2 * t * lanes + first % lanes;
            let r = [runs.blocks[first / lanes][at], runs.blocks[first / lanes][at + lanes]];
            let (s, v) = (&mut r_s[..width], &mut r_v[..width]);
            let (z_1, z_2) = (&mut z_1[..width], &mut z_2[..width]);
            for j in 0..width {
                let (d_s, d_v) = (s[j] - r[0], v[j] - r[1]);
                z_1[j] = w_11[j] * d_s;
                z_2[j] = w_21[j] * d_s + w_22[j] * d_v;
            }
            let z = designed.white(r);
            (z_1[m], z_2[m]) = (z[0], z[1]);
            for (i, z_i) in z.iter().enumerate() {
                outer[i][0] += z_i * z[0];
                outer[i][1] += z_i * z[1];
            }
            for j in 0..=m {
                let (a, b) = (z_1[j], z_2[j]);
                let upto = (j + 1).next_multiple_of(STRIDE);
                let (line, z_1, z_2) = (&mut products[j * width..j * width + upto], &z_1[..upto], &z_2[..upto]);
                for k in 0..upto {
                    line[k] += a * z_1[k] + b * z_2[k];
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
        let (products, outer) = Arch::new().dispatch(|| columns.products(designed, mask));
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
