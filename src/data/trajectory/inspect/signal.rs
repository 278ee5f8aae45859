//! One signal: missing values, range, noise.

use super::Axis;
use crate::statistics::rms;
use crate::trajectory::savitzky_golay::SavitzkyGolay;
use crate::trajectory::steps::runs;
use serde::Serialize;

/// Window and order of the fit whose residual counts as noise (data README, Section 3.1).
const NOISE_POINTS: usize = 11;
const NOISE_ORDER: usize = 3;

/// One signal, in its own unit.
#[derive(Debug, Clone, Serialize)]
pub struct SignalInspection {
    /// Number of missing values.
    pub missing: usize,
    /// Longest run of missing values \[s\].
    pub longest_missing_s: f64,
    /// Smallest value.
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
    /// Standard deviation of the residual against a Savitzky-Golay fit of 11 points, cubic.
    pub noise: Option<f64>,
}

pub(super) fn inspect(values: &[f64], axis: &Axis) -> SignalInspection {
    let missing = || runs(0..values.len(), |i| values[i].is_nan()).map(|run| run.len());
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let filter = SavitzkyGolay::new(NOISE_POINTS, NOISE_ORDER);
    let stretches = axis.stretches.iter();
    let residuals: Vec<f64> = stretches.flat_map(|r| filter.residuals(&values[r.clone()])).collect();
    SignalInspection {
        missing: missing().sum(),
        longest_missing_s: missing().max().unwrap_or(0) as f64 * axis.step,
        min: finite().reduce(f64::min),
        max: finite().reduce(f64::max),
        noise: deviation(&residuals),
    }
}

fn deviation(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    rms(values.iter().map(|value| value - mean))
}
