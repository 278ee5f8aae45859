//! The observers under which searches run: one may show an effect that another hides in its missing acceleration.

use crate::diagnose::drive::Drive;
use crate::diagnose::drive::smoothing::rough;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::policy::POLICY;

/// Missing acceleration \[m/s²\] and its time constant \[s\] of a nearly free simulation: it shows effects that a strong observer corrects
/// away.
const NEARLY_FREE: (f64, f64) = (0.008, 1.0);
/// The same for a strong observer: a run follows the car even with parameters that are far off.
const STRONG: (f64, f64) = (0.15, 2.0);
/// Noise of ordinary sensors of spacing and speed \[m, m/s\].
const ORDINARY: [f64; 2] = [0.02, 0.02];
/// A sensor with less than this share of the ordinary noise is precise.
const PRECISE: f64 = 0.5;
/// Six times the gusts of 0.05 m/s² over 2 s, as the growth of the square of the speed's error \[m²/s³\] (half of it).
const ASTRAY: f64 = 0.03;

impl Noise {
    /// The same sensors with a strong observer.
    #[must_use]
    pub fn strong(&self) -> Noise {
        Noise { sigma_d: STRONG.0, tau_d: STRONG.1, ..*self }
    }

    /// The same sensors with a nearly free simulation.
    #[must_use]
    pub fn nearly_free(&self) -> Noise {
        Noise { sigma_d: NEARLY_FREE.0, tau_d: NEARLY_FREE.1, ..*self }
    }

    /// The same, but no stronger than now: if almost nothing is missing, a stronger observer would hide the effect that a start is to show.
    #[must_use]
    pub fn freer(&self) -> Noise {
        Noise { sigma_d: NEARLY_FREE.0.min(self.sigma_d), tau_d: NEARLY_FREE.1, ..*self }
    }

    /// True if the model compensates for a missing effect by its missing acceleration.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.sigma_d > POLICY.lost_size && self.tau_d > POLICY.lost_time
    }

    /// True if so much is missing that the model may be far off: large or lasting, so it requires less than [`Noise::is_lost`].
    #[must_use]
    pub fn is_astray(&self) -> bool {
        self.sigma_d.powi(2) * self.tau_d > ASTRAY
    }
}

/// The noise to search with if the likelihood is so rugged that a search would stop beside the cause: ordinary noise in place of that of
/// precise sensors, times `factor`. `None` if it is smooth enough.
#[must_use]
pub fn softened(noise: &Noise, factor: f64) -> Option<Noise> {
    let precise = noise.r_s < PRECISE * ORDINARY[0] || noise.r_v < PRECISE * ORDINARY[1];
    if factor <= 1.0 && !precise {
        return None;
    }
    let least = ORDINARY.map(|r| factor * r);
    Some(Noise { r_s: noise.r_s.max(least[0]), r_v: noise.r_v.max(least[1]), ..*noise })
}

/// Noise levels of drives before a fit, and a strong observer.
#[must_use]
pub fn first_noise(drives: &[Drive]) -> Noise {
    let mean = |of: &dyn Fn(&Drive) -> f64| drives.iter().map(of).sum::<f64>() / drives.len().max(1) as f64;
    Noise {
        sigma_d: STRONG.0,
        tau_d: STRONG.1,
        r_s: mean(&|drive| rough(&drive.trajectory.s)).max(1e-4),
        r_v: mean(&|drive| rough(&drive.trajectory.v_f)).max(1e-4),
        r_l: mean(&|drive| rough(&drive.v_l_measured)).max(1e-5),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn precise_sensors_are_searched_with_more_noise() {
        let noise = |r_s: f64, r_v: f64| Noise { sigma_d: 0.1, tau_d: 2.0, r_s, r_v, r_l: 1e-3 };
        let levels = |noise: &Noise| (noise.r_s, noise.r_v);
        assert_eq!(softened(&noise(0.02, 0.015), 1.0), None);
        assert_eq!(softened(&noise(0.0005, 0.03), 1.0).as_ref().map(levels), Some((0.02, 0.03)));
        assert_eq!(softened(&noise(0.05, 0.003), 1.0).as_ref().map(levels), Some((0.05, 0.02)));
        assert_eq!(softened(&noise(0.02, 0.02), 10.0).as_ref().map(levels), Some((0.2, 0.2)));
        assert_eq!(softened(&noise(0.0005, 0.003), 10.0).map(|soft| soft.sigma_d), Some(0.1));
    }
}
