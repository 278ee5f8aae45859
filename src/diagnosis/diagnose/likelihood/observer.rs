//! The steady-state Kalman observer that follows from a noise model.
//!
//! State (s, v_f, d): spacing, speed, missing acceleration; the model's own acceleration is an input.
//! `s- = s - v_f dt - d dt²/2`, `v_f- = v_f + d dt`, `d- = exp(-dt/tau_d) d`, measured: s and v_f.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2};

/// All random terms between the model and the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Standard deviation of the missing acceleration \[m/s²\]; 0: a free simulation.
    pub sigma_d: f64,
    /// Its time constant \[s\].
    pub tau_d: f64,
    /// Measurement noise of the spacing \[m\].
    pub r_s: f64,
    /// Measurement noise of the follower's speed \[m/s\].
    pub r_v: f64,
    /// Measurement noise of the leader's speed \[m/s\]. The leader's displacement is its integral, so this noise moves the spacing from
    /// sample to sample.
    pub r_l: f64,
}

impl Noise {
    /// The noise levels as logarithms, in the order of the fields; [`Noise::from_logs`] is the inverse.
    #[must_use]
    pub fn logs(&self) -> [f64; Noise::COUNT] {
        [self.sigma_d, self.tau_d, self.r_s, self.r_v, self.r_l].map(f64::ln)
    }

    /// See [`Noise::logs`].
    #[must_use]
    pub fn from_logs(logs: [f64; Noise::COUNT]) -> Noise {
        let [sigma_d, tau_d, r_s, r_v, r_l] = logs.map(f64::exp);
        Noise { sigma_d, tau_d, r_s, r_v, r_l }
    }

    /// Number of fields.
    pub const COUNT: usize = 5;
}

/// An observer with the terms of its likelihood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KalmanGain {
    /// Gains of s, v_f and d on the residuals (simulated minus measured) of s and v_f, row by row.
    pub gain: [f64; 6],
    /// `z_1 = whitening[0] r_s`, `z_2 = whitening[1] r_s + whitening[2] r_v`: of unit variance if the model is right.
    pub whitening: [f64; 3],
    /// Factor of d per step.
    pub decay: f64,
    /// ln det S: S is the covariance of the innovations.
    pub log_det: f64,
}

impl KalmanGain {
    /// Whitened innovations.
    #[must_use]
    pub fn white(&self, r: [f64; 2]) -> [f64; 2] {
        let w = &self.whitening;
        [w[0] * r[0], w[1] * r[0] + w[2] * r[1]]
    }
}

/// Largest number of doublings: 2^40 steps of the iteration.
const DOUBLINGS: usize = 40;
/// Relative change of the covariance at convergence.
const STANDS: f64 = 1e-14;

/// The steady state of the Riccati equation of a noise model at time step `dt` \[s\].
#[must_use]
pub fn design(noise: &Noise, dt: f64) -> KalmanGain {
    let decay = (-dt / noise.tau_d).exp();
    let a = Matrix3::new(1.0, -dt, -0.5 * dt * dt, 0.0, 1.0, dt, 0.0, 0.0, decay);
    let c = Matrix2x3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let way = noise.r_l * dt;
    let q = Matrix3::from_diagonal(&[way * way, 0.0, noise.sigma_d * noise.sigma_d * (1.0 - decay * decay)].into());
    let r = Matrix2::from_diagonal(&[noise.r_s * noise.r_s, noise.r_v * noise.r_v].into());
    let p = steady(&a, &c, &q, &r);
    let s = c * p * c.transpose() + r;
    let inverse = s.try_inverse().unwrap_or_else(Matrix2::zeros);
    let k: Matrix3x2<f64> = p * c.transpose() * inverse;
    // S = L L', z = L^-1 r.
    let l_11 = s[(0, 0)].sqrt();
    let l_21 = s[(1, 0)] / l_11;
    let l_22 = (s[(1, 1)] - l_21 * l_21).sqrt();
    KalmanGain {
        gain: [k[(0, 0)], k[(0, 1)], k[(1, 0)], k[(1, 1)], k[(2, 0)], k[(2, 1)]],
        whitening: [1.0 / l_11, -l_21 / (l_11 * l_22), 1.0 / l_22],
        decay,
        log_det: 2.0 * (l_11 * l_22).ln(),
    }
}

/// The predicted covariance by the structure-preserving doubling algorithm (Chu, Fan, Lin and Wang 2004). Each iteration doubles the number
/// of steps of the plain recursion, of which slow disturbances need hundreds of thousands.
fn steady(a: &Matrix3<f64>, c: &Matrix2x3<f64>, q: &Matrix3<f64>, r: &Matrix2<f64>) -> Matrix3<f64> {
    let per_r = Matrix2::from_diagonal(&[1.0 / r[(0, 0)], 1.0 / r[(1, 1)]].into());
    let (mut a, mut g, mut h) = (a.transpose(), c.transpose() * per_r * c, *q);
    for _ in 0..DOUBLINGS {
        let Some(inverse) = (Matrix3::identity() + g * h).try_inverse() else { break };
        let step = a.transpose() * h * inverse * a;
        let next_g = g + a * inverse * g * a.transpose();
        a = a * inverse * a;
        h += 0.5 * (step + step.transpose());
        g = 0.5 * (next_g + next_g.transpose());
        if step.norm() <= STANDS * h.norm() {
            break;
        }
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.1;
    const NOISE: Noise = Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.03, r_l: 0.02 };

    /// The textbook filter, step by step from an uninformative covariance.
    fn dense(noise: &Noise, steps: usize) -> (Matrix3<f64>, Matrix2<f64>, Matrix3x2<f64>) {
        let decay = (-DT / noise.tau_d).exp();
        let a = Matrix3::new(1.0, -DT, -0.5 * DT * DT, 0.0, 1.0, DT, 0.0, 0.0, decay);
        let c = Matrix2x3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        let q = [(noise.r_l * DT).powi(2), 0.0, noise.sigma_d.powi(2) * (1.0 - decay * decay)];
        let q = Matrix3::from_diagonal(&q.into());
        let r = Matrix2::from_diagonal(&[noise.r_s.powi(2), noise.r_v.powi(2)].into());
        let mut p = Matrix3::identity();
        let mut k = Matrix3x2::zeros();
        let mut s = r;
        for _ in 0..steps {
            s = c * p * c.transpose() + r;
            k = p * c.transpose() * s.try_inverse().expect("positive");
            p = a * (Matrix3::identity() - k * c) * p * a.transpose() + q;
        }
        (p, s, k)
    }

    #[test]
    fn equals_the_filter_that_has_run_for_long() {
        for noise in [NOISE, Noise { tau_d: 0.4, ..NOISE }, Noise { sigma_d: 0.4, r_l: 1e-6, ..NOISE }] {
            let found = design(&noise, DT);
            let (_, s, k) = dense(&noise, 40_000);
            for (i, gain) in found.gain.iter().enumerate() {
                assert!((gain - k[(i / 2, i % 2)]).abs() < 1e-9, "{noise:?}: gain {i} {gain}, {}", k[(i / 2, i % 2)]);
            }
            assert!((found.log_det - s.determinant().ln()).abs() < 1e-9);
            let (z_1, z_2) = (found.white([1.0, 0.0]), found.white([0.0, 1.0]));
            let per_s = s.try_inverse().expect("positive");
            assert!((z_1[0] * z_1[0] + z_1[1] * z_1[1] - per_s[(0, 0)]).abs() < 1e-6 * per_s[(0, 0)]);
            assert!((z_1[0] * z_2[0] + z_1[1] * z_2[1] - per_s[(0, 1)]).abs() < 1e-6 * per_s[(0, 0)]);
        }
    }

    #[test]
    fn without_disturbances_it_is_a_free_simulation() {
        let still = design(&Noise { sigma_d: 0.0, r_l: 0.0, ..NOISE }, DT);
        assert_eq!(still.gain, [0.0; 6]);
        assert!((still.whitening[0] - 50.0).abs() < 1e-9 && still.whitening[1].abs() < 1e-12);
        let small = design(&Noise { sigma_d: 1e-8, r_l: 1e-8, ..NOISE }, DT);
        assert!(small.gain.iter().all(|gain| gain.abs() < 1e-3), "{small:?}");
        let strong = design(&Noise { sigma_d: 3.0, ..NOISE }, DT);
        assert!(strong.gain[3] > 0.5, "{strong:?}");
    }

    #[test]
    fn logs_are_read_back() {
        assert!(Noise::from_logs(NOISE.logs()).logs().iter().zip(NOISE.logs()).all(|(a, b)| (a - b).abs() < 1e-14));
    }
}
