use super::{Command, Perceived};
use crate::symbols::Parameters;

/// Eq. 2: commanded acceleration of the IDM \[m/s²\].
pub fn commanded_acceleration(p: &Parameters, x: &Perceived, s_des: f64, _v_f: f64) -> Command {
    // A measured speed may lie slightly below zero; it means standstill.
    let share = (x.v_f / p.v_0).max(0.0);
    Command::of(p.a_max * (1.0 - share.powf(p.delta) - (s_des / x.s).powi(2)))
}
