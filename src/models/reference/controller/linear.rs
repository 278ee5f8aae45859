use super::{Command, Perceived};
use crate::symbols::Parameters;

/// Eq. 6: commanded acceleration of the linear control law \[m/s²\].
pub fn commanded_acceleration(p: &Parameters, x: &Perceived, s_des: f64, _v_f: f64) -> Command {
    let ds = s_des - x.s;
    Command::of((p.k_v * x.dv() - p.k_s * ds).min(p.k_0 * (p.v_0 - x.v_f)))
}
