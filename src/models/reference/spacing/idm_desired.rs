use super::Perceived;
use crate::symbols::Parameters;

/// Eq. 3: desired spacing of the IDM \[m\].
pub fn desired_spacing(p: &Parameters, x: &Perceived) -> f64 {
    p.d_0 + (p.t_h * x.v_f - x.v_f * x.dv() / (2.0 * (-p.a_max * p.a_min).sqrt())).max(0.0)
}
