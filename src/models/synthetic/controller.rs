//! Acceleration commands in continuous time, written from the printed equations.

use super::car::Controller;

/// Knowledge of a follower at its decision; all but `v_now` are old by the perception delay.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Spacing \[m\].
    pub(super) gap: f64,
    /// Own speed \[m/s\].
    pub(super) v: f64,
    /// Speed of the car ahead \[m/s\].
    pub(super) v_ahead: f64,
    /// Own speed without delay \[m/s\]: the paper does not delay it in Eq. 4.
    pub(super) v_now: f64,
}

impl Controller {
    /// Acceleration command \[m/s²\] with a desired spacing that is `extra` \[m\] larger.
    pub(super) fn command(&self, seen: Seen, extra: f64) -> f64 {
        match *self {
            Controller::Idm { v_0, t_h, d_0, a_max, a_min, delta } => {
                let wanted = d_0 + extra + beyond_standstill(seen, t_h, a_max, a_min);
                a_max * (1.0 - (seen.v / v_0).powf(delta) - (wanted / seen.gap).powi(2))
            }
            Controller::Gipps { v_0, t_h, d_0, a_max, a_min, a_hat_min, theta } => {
                let share = seen.v / v_0;
                let free = seen.v + 2.5 * a_max * t_h * (1.0 - share) * (0.025 + share).sqrt();
                let b = -a_min;
                let reaction = b * (t_h / 2.0 + theta);
                let room = 2.0 * (seen.gap - d_0 - extra) - t_h * seen.v + seen.v_ahead * seen.v_ahead / -a_hat_min;
                // A negative radicand means that no speed is safe: brake as for a stop.
                let safe = (reaction * reaction + b * room).max(0.0).sqrt() - reaction;
                (free.min(safe) - seen.v_now) / t_h
            }
            Controller::Linear { v_0, t_h, d_0, k_s, k_v, k_0 } => {
                linear(seen, d_0 + extra + t_h * seen.v, v_0, [k_s, k_v, k_0])
            }
            Controller::LinearIdm { v_0, t_h, d_0, k_s, k_v, k_0, a_max, a_min } => {
                linear(seen, d_0 + extra + beyond_standstill(seen, t_h, a_max, a_min), v_0, [k_s, k_v, k_0])
            }
            Controller::LinearGipps { v_0, k_s, k_v, k_0, .. } => {
                linear(seen, extra + self.equilibrium_gap(seen.v), v_0, [k_s, k_v, k_0])
            }
        }
    }

    /// Spacing \[m\] at which a car at constant speed `v` \[m/s\] behind another at that speed does not change it.
    pub(super) fn equilibrium_gap(&self, v: f64) -> f64 {
        match *self {
            Controller::Idm { v_0, t_h, d_0, delta, .. } => {
                // Near the desired speed there is no such spacing; then ten times the spacing of a slow car.
                (d_0 + t_h * v) / (1.0 - (v / v_0).powf(delta)).max(0.01).sqrt()
            }
            Controller::Gipps { t_h, d_0, a_min, a_hat_min, theta, .. }
            | Controller::LinearGipps { t_h, d_0, a_min, a_hat_min, theta, .. } => {
                d_0 + (t_h + theta) * v + v * v * (1.0 / a_hat_min - 1.0 / a_min) / 2.0
            }
            Controller::Linear { t_h, d_0, .. } | Controller::LinearIdm { t_h, d_0, .. } => d_0 + t_h * v,
        }
    }
}

/// Eq. 3 without the standstill spacing \[m\].
fn beyond_standstill(seen: Seen, t_h: f64, a_max: f64, a_min: f64) -> f64 {
    let braking = seen.v * (seen.v - seen.v_ahead) / (2.0 * (a_max * -a_min).sqrt());
    (t_h * seen.v + braking).max(0.0)
}

/// Eq. 6 with this desired spacing \[m\] and the gains k_s, k_v and k_0.
fn linear(seen: Seen, wanted: f64, v_0: f64, [k_s, k_v, k_0]: [f64; 3]) -> f64 {
    let follow = k_v * (seen.v_ahead - seen.v) + k_s * (seen.gap - wanted);
    follow.min(k_0 * (v_0 - seen.v))
}

#[cfg(test)]
mod tests {
    use super::*;

    const STANDING: Seen = Seen { gap: 2.0, v: 0.0, v_ahead: 0.0, v_now: 0.0 };

    /// One of each kind, with these free parameters of the spacing.
    fn all(a_min: f64, a_hat_min: f64) -> [Controller; 5] {
        let (v_0, t_h, d_0) = (30.0, 1.0, 2.0);
        let (k_s, k_v, k_0) = (0.2, 0.8, 0.5);
        [
            Controller::Idm { v_0, t_h, d_0, a_max: 1.5, a_min, delta: 4.0 },
            Controller::Gipps { v_0, t_h, d_0, a_max: 1.5, a_min, a_hat_min, theta: 0.5 },
            Controller::Linear { v_0, t_h, d_0, k_s, k_v, k_0 },
            Controller::LinearIdm { v_0, t_h, d_0, k_s, k_v, k_0, a_max: 1.5, a_min },
            Controller::LinearGipps { v_0, t_h, d_0, k_s, k_v, k_0, theta: 0.5, a_min, a_hat_min },
        ]
    }

    #[test]
    fn nobody_moves_at_the_standstill_spacing() {
        for controller in all(-2.0, -2.0) {
            assert!(controller.command(STANDING, 0.0).abs() < 1e-12, "{controller:?}");
        }
    }

    /// 20 m/s behind 18 m/s at 40 m. Gipps: reaction = 2 * 1 = 2, room = 2*38 - 20 + 18^2/2.5 = 185.6,
    /// safe = sqrt(4 + 2*185.6) - 2 = 17.370 080, a = 17.370 080 - 20 = -2.629 920.
    #[test]
    fn hand_worked() {
        let seen = Seen { gap: 40.0, v: 20.0, v_ahead: 18.0, v_now: 20.0 };
        let gipps =
            Controller::Gipps { v_0: 30.0, t_h: 1.0, d_0: 2.0, a_max: 1.5, a_min: -2.0, a_hat_min: -2.5, theta: 0.5 };
        assert!((gipps.command(seen, 0.0) - -2.629_920).abs() < 1e-6);
        // IDM: braking = 20*2/(2*sqrt(1*4)) = 10, wanted = 2 + 20 + 10 = 32, (32/40)^2 = 0.64, (20/30)^2 = 0.4444.
        let idm = Controller::Idm { v_0: 30.0, t_h: 1.0, d_0: 2.0, a_max: 1.0, a_min: -4.0, delta: 2.0 };
        assert!((idm.command(seen, 0.0) - (1.0 - 4.0 / 9.0 - 0.64)).abs() < 1e-12);
        // Linear: 0.5*(-2) + 0.1*(40 - 22) = 0.8, capped by 0.05*(30 - 20) = 0.5.
        let linear = Controller::Linear { v_0: 30.0, t_h: 1.0, d_0: 2.0, k_s: 0.1, k_v: 0.5, k_0: 0.05 };
        assert!((linear.command(seen, 0.0) - 0.5).abs() < 1e-12);
        let (v_0, t_h, d_0, k_s, k_v, k_0) = (30.0, 1.0, 2.0, 0.1, 0.5, 0.3);
        // The spacing of that IDM: 0.5*(-2) + 0.1*(40 - 32) = -0.2.
        let l_idm = Controller::LinearIdm { v_0, t_h, d_0, k_s, k_v, k_0, a_max: 1.0, a_min: -4.0 };
        assert!((l_idm.command(seen, 0.0) - -0.2).abs() < 1e-12);
        // Wanted: 2 + 1.5*20 - 0.5*400*(1/(-2) - 1/(-2.5)) = 32 + 20 = 52; 0.5*(-2) + 0.1*(40 - 52) = -2.2.
        let l_gipps =
            Controller::LinearGipps { v_0, t_h, d_0, k_s, k_v, k_0, theta: 0.5, a_min: -2.0, a_hat_min: -2.5 };
        assert!((l_gipps.command(seen, 0.0) - -2.2).abs() < 1e-12);
    }

    #[test]
    fn the_equilibrium_holds() {
        for controller in all(-2.0, -2.5) {
            for v in [5.0, 15.0, 22.0] {
                let seen = Seen { gap: controller.equilibrium_gap(v), v, v_ahead: v, v_now: v };
                assert!(controller.command(seen, 0.0).abs() < 1e-12, "{controller:?} at {v} m/s");
            }
        }
    }
}
