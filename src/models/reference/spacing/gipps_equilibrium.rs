use super::Perceived;
use crate::symbols::Parameters;

/// Eq. 8: desired spacing of Gipps' model at equilibrium \[m\].
pub fn desired_spacing(p: &Parameters, x: &Perceived) -> f64 {
    p.d_0 + (p.t_h + p.theta) * x.v_f - 0.5 * x.v_f * x.v_f * (1.0 / p.a_min - 1.0 / p.a_hat_min)
}
