use super::{Command, Perceived};
use crate::symbols::Parameters;

/// Input of a law: the present speed \[m/s\]. The law itself is a stage after this one.
pub fn commanded_acceleration(_p: &Parameters, _x: &Perceived, _s_des: f64, v_f: f64) -> Command {
    Command::of(v_f)
}
