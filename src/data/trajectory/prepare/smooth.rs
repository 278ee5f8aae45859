//! The smoothing of the paper's authors: two Savitzky-Golay passes over speed, clipped at standstill.
//!
//! They differentiate positions, smooth the speed, integrate it, and do the same once more. Speeds are measured here, so
//! differentiating the integral would give them back, and the two passes apply to the speeds directly. Their spacing is a
//! difference of such positions; the filter being linear, the same passes over the measured spacing do the same to it.

use super::samples::{Samples, Signal};
use crate::trajectory::Note;
use crate::trajectory::savitzky_golay::SavitzkyGolay;

/// Points of the window, whatever the time step: 5.0 s at 0.1 s (data README, Section 3.3).
pub(super) const POINTS: usize = 51;
const ORDER: usize = 3;
const PASSES: usize = 2;

/// Smooths all speeds and spacings of a segment of at least [`POINTS`] samples.
pub(super) fn smooth(samples: &mut Samples, dt: f64) -> Note {
    let filter = SavitzkyGolay::new(POINTS, ORDER);
    let mut change = |signal: Signal| {
        let Some((_, values)) = samples.channels.iter_mut().find(|(s, _)| *s == signal) else {
            return 0.0;
        };
        let mut smooth = values.clone();
        for _ in 0..PASSES {
            smooth = filter.smooth(&smooth);
            if signal.is_speed() {
                smooth.iter_mut().for_each(|v| *v = v.max(0.0));
            }
        }
        let squares = smooth.iter().zip(values.iter()).map(|(a, b)| (a - b).powi(2));
        let rms = (squares.sum::<f64>() / smooth.len() as f64).sqrt();
        *values = smooth;
        rms
    };
    change(Signal::Lead2Speed);
    change(Signal::Lead2Spacing);
    Note::Smoothed {
        passes: PASSES,
        points: POINTS,
        order: ORDER,
        dt_s: dt,
        lead_speed_rms_mps: change(Signal::LeadSpeed),
        speed_rms_mps: change(Signal::Speed),
        spacing_rms_m: change(Signal::Spacing),
    }
}
