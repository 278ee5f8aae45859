//! First and second derivatives of the likelihood of innovations, from finite differences.
//!
//! Fisher scoring for a Gaussian innovations likelihood: parameters of the model change the innovations, those of the noise also
//! change their covariance, and both are estimated in one step.

use super::observer::{Designed, Noise};
use nalgebra::{DMatrix, DVector};

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

/// A run with one coordinate a step further.
#[derive(Debug, Clone, Copy)]
pub struct Column<'a> {
    /// Its innovations; `None` if it failed, which makes the column 0.
    pub residuals: Option<&'a [[f64; 2]]>,
    /// Its observer.
    pub designed: &'a Designed,
    /// The step.
    pub step: f64,
}

/// Negative log-likelihood of the samples that count.
#[must_use]
pub fn cost(residuals: &[[f64; 2]], designed: &Designed, mask: &[bool]) -> f64 {
    let (mut squares, mut samples) = (0.0, 0.0);
    for (r, counts) in residuals.iter().zip(mask) {
        if *counts {
            let z = designed.white(*r);
            squares += z[0] * z[0] + z[1] * z[1];
            samples += 1.0;
        }
    }
    0.5 * (squares + samples * designed.log_det)
}

impl Gram {
    /// Of nothing.
    #[must_use]
    pub fn zero(coordinates: usize) -> Gram {
        let (gradient, information) = (DVector::zeros(coordinates), DMatrix::zeros(coordinates, coordinates));
        Gram { cost: 0.0, gradient, information, samples: 0 }
    }

    /// Adds one drive. The last [`Noise::COUNT`] columns are those of the noise.
    pub fn add(&mut self, residuals: &[[f64; 2]], designed: &Designed, columns: &[Column<'_>], mask: &[bool]) {
        let m = columns.len();
        let first_noise = m - Noise::COUNT;
        // Products of all columns, the last one being the innovations themselves.
        let width = m + 1;
        let mut products = vec![0.0; width * width];
        let mut row = [vec![0.0; width], vec![0.0; width]];
        let mut outer = [[0.0; 2]; 2];
        let mut samples = 0;
        for (t, r) in residuals.iter().enumerate() {
            if !mask[t] {
                continue;
            }
            samples += 1;
            for (j, column) in columns.iter().enumerate() {
                let change = column.residuals.map_or([0.0; 2], |c| [c[t][0] - r[0], c[t][1] - r[1]]);
                let white = designed.white(change);
                row[0][j] = white[0] / column.step;
                row[1][j] = white[1] / column.step;
            }
            let z = designed.white(*r);
            (row[0][m], row[1][m]) = (z[0], z[1]);
            for (i, z_i) in z.iter().enumerate() {
                outer[i][0] += z_i * z[0];
                outer[i][1] += z_i * z[1];
            }
            for row in &row {
                for (j, &x) in row.iter().enumerate() {
                    let line = &mut products[j * width..j * width + j + 1];
                    line.iter_mut().zip(row).for_each(|(sum, y)| *sum += x * y);
                }
            }
        }
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
        let relative: Vec<[f64; 3]> = columns[first_noise..].iter().map(|c| relative(designed, c)).collect();
        for (j, a) in relative.iter().enumerate() {
            let column = &columns[first_noise + j];
            let log_det = (column.designed.log_det - designed.log_det) / column.step;
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
fn relative(designed: &Designed, column: &Column<'_>) -> [f64; 3] {
    let [w_11, w_21, w_22] = designed.whitening;
    let mut change = column.designed.whitening;
    change.iter_mut().zip(designed.whitening).for_each(|(new, old)| *new = (*new - old) / column.step);
    let [d_11, d_21, d_22] = change;
    [d_11 / w_11, (d_21 - d_22 * w_21 / w_22) / w_11, d_22 / w_22]
}
