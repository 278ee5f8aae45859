use super::Perceived;
use crate::symbols::Parameters;

/// Eq. 7: desired spacing at a constant time headway \[m\].
pub fn desired_spacing(p: &Parameters, x: &Perceived) -> f64 {
    p.d_0 + p.t_h * x.v_f
}
