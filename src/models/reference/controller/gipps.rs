use super::{Command, Perceived};
use crate::symbols::Parameters;

/// Rounding alone may make a radicand of zero slightly negative; below this, no speed is safe \[m²/s²\].
const RADICAND_TOLERANCE: f64 = 1e-10;

/// Eqs. 4 and 5: commanded acceleration of Gipps' model \[m/s²\]; infeasible if the radicand is negative.
pub fn commanded_acceleration(p: &Parameters, x: &Perceived, _s_des: f64, v_f: f64) -> Command {
    let free = x.v_f + 2.5 * p.a_max * p.t_h * (1.0 - x.v_f / p.v_0) * (0.025 + x.v_f / p.v_0).sqrt();
    let h = p.t_h / 2.0 + p.theta;
    let radicand =
        p.a_min.powi(2) * h.powi(2) - p.a_min * (2.0 * (x.s - p.d_0) - p.t_h * x.v_f - x.v_l.powi(2) / p.a_hat_min);
    let safe = p.a_min * h + radicand.max(0.0).sqrt();
    let v_cmd = free.min(safe);
    Command { a_cmd: (v_cmd - v_f) / p.t_h, feasible: radicand >= -RADICAND_TOLERANCE }
}
