//! Savitzky-Golay smoothing: a least-squares polynomial through a moving window.

use nalgebra::{DMatrix, DVector};

/// A filter of an odd number of points and a polynomial order.
pub struct SavitzkyGolay {
    /// Row i gives the fitted value at point i of the window: the middle row is the filter, the others apply to the ends.
    rows: DMatrix<f64>,
}

impl SavitzkyGolay {
    /// `points` must be odd and larger than `order`.
    pub fn new(points: usize, order: usize) -> Self {
        let half = (points / 2) as f64;
        let design = DMatrix::from_fn(points, order + 1, |i, j| {
            // Scaled to -1..1, which keeps the least-squares problem well conditioned.
            ((i as f64 - half) / half.max(1.0)).powi(j as i32)
        });
        // The projection onto the polynomials is Q Q^T of the design's orthogonal basis.
        let q = design.qr().q();
        SavitzkyGolay { rows: &q * q.transpose() }
    }

    /// Number of points of the window.
    pub fn points(&self) -> usize {
        self.rows.nrows()
    }

    /// The smoothed signal; within half a window of the ends the polynomial of the outermost whole window is used, as
    /// `scipy.signal.savgol_filter` does by default. Signals shorter than the window are returned unchanged.
    pub fn smooth(&self, y: &[f64]) -> Vec<f64> {
        let points = self.points();
        let half = points / 2;
        if y.len() < points {
            return y.to_vec();
        }
        let last = y.len() - points;
        let fit = |window: usize, row: usize| -> f64 {
            let window = &y[window..window + points];
            window.iter().zip(self.rows.row(row).iter()).map(|(y_i, w)| y_i * w).sum()
        };
        (0..y.len())
            .map(|i| {
                let window = i.saturating_sub(half).min(last);
                fit(window, i - window)
            })
            .collect()
    }

    /// Signal minus fit at the middle of every window that has no NaN \[unit of y\].
    pub fn residuals(&self, y: &[f64]) -> Vec<f64> {
        let half = self.points() / 2;
        let middle = DVector::from_iterator(self.points(), self.rows.row(half).iter().copied());
        y.windows(self.points())
            .map(|window| {
                let fit: f64 = window.iter().zip(middle.iter()).map(|(y_i, w)| y_i * w).sum();
                window[half] - fit
            })
            .filter(|residual| residual.is_finite())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::SavitzkyGolay;

    #[test]
    fn textbook_weights_of_five_points_and_a_parabola() {
        // Savitzky and Golay 1964: (-3 12 17 12 -3) / 35; at the first point (31 9 -3 -5 3) / 35.
        let filter = SavitzkyGolay::new(5, 2);
        let unit = |i: usize| (0..5).map(|j| f64::from(u8::from(i == j))).collect::<Vec<_>>();
        for (i, (middle, first)) in
            [(-3.0, 31.0), (12.0, 9.0), (17.0, -3.0), (12.0, -5.0), (-3.0, 3.0)].into_iter().enumerate()
        {
            let smooth = filter.smooth(&unit(i));
            assert!((smooth[2] - middle / 35.0).abs() < 1e-14, "{i}: {smooth:?}");
            assert!((smooth[0] - first / 35.0).abs() < 1e-14, "{i}: {smooth:?}");
        }
    }

    #[test]
    fn a_cubic_passes_unchanged_up_to_the_ends() {
        let y: Vec<f64> =
            (0..80).map(|i| f64::from(i) / 20.0).map(|x| 1.0 + x - 2.0 * x * x + 0.3 * x * x * x).collect();
        for (smooth, y) in SavitzkyGolay::new(51, 3).smooth(&y).iter().zip(&y) {
            assert!((smooth - y).abs() < 1e-12, "{smooth} {y}");
        }
    }
}
