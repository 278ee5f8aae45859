//! Accelerations that are mostly noise: the differences of noisy speeds over short steps.

use crate::statistics::robust_scale;

/// From this share of noise on, an error of the acceleration says more of the sensor than of the model.
const MOSTLY: f64 = 0.5;
/// Fewer samples tell nothing.
const SAMPLES: usize = 50;

/// Which share of the variance of the acceleration, differences of the speed `v` over `dt` \[s\], is noise that changes from sample to sample.
pub(super) fn share(v: &[f64], dt: f64) -> Option<f64> {
    let a = |i: usize| (v[i + 1] - v[i]) / dt;
    let squares: Vec<f64> =
        (0..v.len().saturating_sub(1)).map(|i| a(i) * a(i)).filter(|square| square.is_finite()).collect();
    if squares.len() < SAMPLES {
        return None;
    }
    let total = squares.iter().sum::<f64>() / squares.len() as f64;
    // Third differences leave nothing of what a car does within three samples; those of white noise have twenty times its variance.
    let thirds = v.windows(4).map(|v| v[3] - 3.0 * v[2] + 3.0 * v[1] - v[0]);
    let noise = robust_scale(thirds).unwrap_or(0.0).powi(2) / 20.0;
    (total > 0.0).then(|| (2.0 * noise / (dt * dt) / total).min(1.0))
}

/// That the accelerations of a follower are mostly noise, with the share and what to do.
pub(super) fn said(v: &[f64], dt: f64) -> Option<String> {
    let share = share(v, dt).filter(|share| *share > MOSTLY)?;
    Some(format!(
        "the acceleration of the follower, from its speeds every {dt} s, is noise to {:.0} % (of its variance): a score with it, such as \
         nrmse-sva, judges the sensor, not the model; --gof nrmse-s leaves it out, --smooth or a longer step (--resample) lessen it",
        100.0 * share
    ))
}
