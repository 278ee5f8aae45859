//! Smooths a measured speed as much as its noise requires.

use crate::statistics::upper_median;
use nalgebra::{Matrix2, RowVector2, Vector2};

/// Smallest and largest smoothness: intensity of the jerk over the variance of the noise, ln(1/s³).
const RANGE: (f64, f64) = (-7.0, 23.0);
/// Number of values in the first grid.
const TRIED: usize = 31;
/// Number of halvings of the grid spacing.
const HALVINGS: usize = 6;
/// Variance of the unknown initial state, relative to that of the noise.
const UNKNOWN: f64 = 1e9;

/// The speed of a car whose acceleration wanders (its jerk is white), measured with white noise: the Rauch-Tung-Striebel smoother, a cubic
/// smoothing spline (Wahba 1978, J. R. Stat. Soc. B 40, 364-372), with the likeliest smoothness. With too little smoothing, a filter or a
/// lag predicts better although the car has none; with too much, blunted accelerations of the leader suggest other causes. `y` \[m/s\] in
/// steps of `dt` \[s\].
pub fn smoothed(y: &[f64], dt: f64) -> Vec<f64> {
    if y.len() < 4 {
        return y.to_vec();
    }
    let likelihood = |ln: f64| Filtered::new(y, dt, ln.exp()).log_likelihood;
    let step = (RANGE.1 - RANGE.0) / (TRIED - 1) as f64;
    let tried = (0..TRIED).map(|k| RANGE.0 + k as f64 * step).map(|ln| (likelihood(ln), ln));
    let mut best = tried.max_by(|a, b| a.0.total_cmp(&b.0)).expect("some are tried");
    let mut step = step;
    for _ in 0..HALVINGS {
        step *= 0.5;
        for ln in [best.1 - step, best.1 + step] {
            let found = likelihood(ln);
            if found > best.0 {
                best = (found, ln);
            }
        }
    }
    Filtered::new(y, dt, best.1.exp()).smoothed()
}

/// Standard deviation of white noise on a smooth signal, from the median of third differences, so that events do not count. The variance of
/// third differences is 20 times that of the noise.
#[must_use]
pub fn rough(y: &[f64]) -> f64 {
    let size = y.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs());
    // The median of |x| is 0.6745 standard deviations.
    let median = upper_median(size).unwrap_or(0.0);
    median / 0.6745 / 20.0_f64.sqrt()
}

/// Filtered speed and acceleration, from the samples up to each one, with their covariance relative to the noise variance.
struct Filtered {
    transition: Matrix2<f64>,
    predicted: Vec<(Vector2<f64>, Matrix2<f64>)>,
    updated: Vec<(Vector2<f64>, Matrix2<f64>)>,
    log_likelihood: f64,
}

impl Filtered {
    fn new(y: &[f64], dt: f64, smoothness: f64) -> Filtered {
        let transition = Matrix2::new(1.0, dt, 0.0, 1.0);
        let wander = smoothness * Matrix2::new(dt.powi(3) / 3.0, dt * dt / 2.0, dt * dt / 2.0, dt);
        let seen = RowVector2::new(1.0, 0.0);
        let mut state = (Vector2::new(y[0], 0.0), Matrix2::from_diagonal_element(UNKNOWN));
        let (mut predicted, mut updated) = (Vec::with_capacity(y.len()), Vec::with_capacity(y.len()));
        let (mut squares, mut logs) = (0.0, 0.0);
        for (i, y) in y.iter().enumerate() {
            let (mean, covariance) = state;
            predicted.push(state);
            let variance = covariance.m11 + 1.0;
            let innovation = y - mean.x;
            let gain = covariance.column(0) / variance;
            let now = (mean + gain * innovation, (Matrix2::identity() - gain * seen) * covariance);
            updated.push(now);
            state = (transition * now.0, transition * now.1 * transition.transpose() + wander);
            // The first two samples give the initial state.
            if i > 1 {
                squares += innovation * innovation / variance;
                logs += variance.ln();
            }
        }
        // The variance of the noise is the likeliest one.
        let count = (y.len() - 2) as f64;
        let log_likelihood = -0.5 * (count * (squares / count).max(f64::MIN_POSITIVE).ln() + logs);
        Filtered { transition, predicted, updated, log_likelihood }
    }

    /// Smoothed speed, from all samples.
    fn smoothed(&self) -> Vec<f64> {
        let last = self.updated.len() - 1;
        let mut mean = self.updated[last].0;
        let mut speeds = vec![mean.x; last + 1];
        for i in (0..last).rev() {
            let (here, covariance) = self.updated[i];
            let (next, next_covariance) = self.predicted[i + 1];
            if let Some(inverse) = next_covariance.try_inverse() {
                mean = here + covariance * self.transition.transpose() * inverse * (mean - next);
            } else {
                mean = here;
            }
            speeds[i] = mean.x;
        }
        speeds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::stream;
    use crate::trajectory::savitzky_golay::SavitzkyGolay;
    use rand::RngExt;

    /// A car that alternately accelerates and brakes by 1 m/s², every 4 s.
    fn zigzag(noise: f64) -> (Vec<f64>, Vec<f64>) {
        let mut rng = stream(1, 0, 0, 0);
        let true_speed = |i: usize| 20.0 + 4.0 * ((i as f64 / 40.0) % 2.0 - 1.0).abs();
        let truth: Vec<f64> = (0..3000).map(true_speed).collect();
        let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        let measured = truth.iter().map(|v| v + noise * normal()).collect();
        (truth, measured)
    }

    /// Remaining error of noise and blunted turns \[m/s\].
    fn error(noise: f64, smoothed: impl Fn(&[f64]) -> Vec<f64>) -> f64 {
        let (truth, measured) = zigzag(noise);
        let squares = smoothed(&measured).iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        (squares / truth.len() as f64).sqrt()
    }

    /// Whatever the noise, the error is smaller than with a window of 15 samples, which, with precise sensors, blunts the turns by ten
    /// times the noise.
    #[test]
    fn noise_goes_and_turns_stay() {
        let ours = |noise: f64| error(noise, |y| smoothed(y, 0.1));
        let window = |noise: f64| error(noise, |y| SavitzkyGolay::new(15, 2).smooth(y));
        for (noise, share) in [(0.0, 0.2), (0.002, 0.2), (0.02, 0.6), (0.05, 0.9), (0.2, 1.0)] {
            assert!(
                ours(noise) < share * window(noise),
                "{noise}: {} left, by a window {}",
                ours(noise),
                window(noise)
            );
        }
        assert!(ours(0.2) < 0.5 * 0.2, "{}", ours(0.2));
    }

    #[test]
    fn a_constant_speed_stays() {
        assert!(smoothed(&[0.0; 50], 0.1).iter().all(|v| v.abs() < 1e-12));
        assert!(smoothed(&[12.5; 50], 0.1).iter().all(|v| (v - 12.5).abs() < 1e-9));
        assert_eq!(smoothed(&[1.0, 2.0], 0.1), [1.0, 2.0]);
    }
}
