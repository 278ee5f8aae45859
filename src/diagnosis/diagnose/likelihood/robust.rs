//! Scores of innovations: Gaussian for fits, Huber's for comparisons of models, per stretch of time.

use super::observer::KalmanGain;
use crate::diagnose::policy::POLICY;

/// Huber's threshold in standard deviations.
const HUBER: f64 = POLICY.huber;
/// Lags of the autocorrelation.
const LAGS: usize = POLICY.lags as usize;

/// Which samples of a drive count.
pub type Mask = Vec<bool>;

/// Huber's rho of a squared length: half of it up to the threshold, then linear in the length.
pub(crate) fn rho(squared: f64) -> f64 {
    if squared <= HUBER * HUBER { 0.5 * squared } else { HUBER * squared.sqrt() - 0.5 * HUBER * HUBER }
}

/// Number of samples in a block.
pub fn block_length(dt: f64) -> usize {
    (POLICY.block / dt).round().max(1.0) as usize
}

/// Robust log-likelihood per block of one drive, over the samples that count.
#[must_use]
pub fn blocks(residuals: &[[f64; 2]], designed: &KalmanGain, mask: &[bool], dt: f64) -> Vec<f64> {
    let length = block_length(dt);
    let mut sums = vec![0.0; residuals.len().div_ceil(length)];
    for (t, r) in residuals.iter().enumerate().filter(|(t, _)| mask[*t]) {
        let z = designed.white(*r);
        sums[t / length] -= rho(z[0] * z[0] + z[1] * z[1]) + 0.5 * designed.log_det;
    }
    sums
}

/// Ratio of the number of innovations to that of independent ones with the same information: 1 + 2 sum of Bartlett-weighted
/// autocorrelations, the larger of the two signals, at least 1.
#[must_use]
pub fn inflation(drives: &[Vec<[f64; 2]>], designed: &[KalmanGain], masks: &[Mask]) -> f64 {
    let of = |k: usize| {
        let mut covariances = [0.0; LAGS + 1];
        for ((residuals, designed), mask) in drives.iter().zip(designed).zip(masks) {
            let white = |(r, counts): (&[f64; 2], &bool)| if *counts { designed.white(*r)[k] } else { 0.0 };
            let z: Vec<f64> = residuals.iter().zip(mask).map(white).collect();
            // Clipped, so that one event does not dominate the correlation.
            let z: Vec<f64> = z.iter().map(|z| z.clamp(-HUBER, HUBER)).collect();
            for (lag, sum) in covariances.iter_mut().enumerate().take(z.len()) {
                *sum += z[lag..].iter().zip(&z).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        let weight = |lag: usize| 1.0 - lag as f64 / (LAGS + 1) as f64;
        let correlated: f64 = (1..=LAGS).map(|lag| weight(lag) * covariances[lag]).sum();
        1.0 + 2.0 * correlated / covariances[0].max(f64::MIN_POSITIVE)
    };
    of(0).max(of(1)).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::stream;
    use rand::RngExt;

    const UNIT: KalmanGain = KalmanGain { gain: [0.0; 6], whitening: [1.0, 0.0, 1.0], decay: 1.0, log_det: 0.0 };

    #[test]
    fn blocks_add_up_and_are_clipped() {
        let mut residuals = vec![[1.0, 1.0]; 500];
        residuals[400] = [100.0, 0.0];
        let mut mask = vec![true; 500];
        mask[0] = false;
        let found = blocks(&residuals, &UNIT, &mask, 0.1);
        assert_eq!(found, [-299.0, -199.0 - (500.0 - 12.5)]);
    }

    #[test]
    fn inflation_is_that_of_an_autoregression() {
        // AR(1) with rho 0.8: (1 + rho) / (1 - rho) = 9, minus the effect of the Bartlett weights.
        let mut rng = stream(1, 0, 0, 0);
        let mut last = 0.0;
        let mut next = |rho: f64| {
            last = rho * last + (rng.random::<f64>() - 0.5);
            [last, 0.0]
        };
        let coloured: Vec<[f64; 2]> = (0..40_000).map(|_| next(0.8)).collect();
        let white: Vec<[f64; 2]> = (0..40_000).map(|_| next(0.0)).collect();
        let of = |r: Vec<[f64; 2]>| inflation(&[r], &[UNIT], &[vec![true; 40_000]]);
        assert!((of(coloured) - 8.6).abs() < 0.8);
        assert!(of(white) < 1.25);
    }
}
