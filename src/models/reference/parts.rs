//! The parts one by one, for the tests that compare them with shaders/; not a public interface.

use super::types::{Ego, Perceived, Road};
use super::{constraint, controller, dynamics, spacing};
use crate::catalog::{Constraint, Controller, Dynamics, Spacing};
use crate::symbols::Parameters;

fn perceived([s, v_f, v_l]: [f64; 3]) -> Perceived {
    Perceived { s, v_f, v_l }
}

/// Of perceived spacing, speed and speed of the preceding vehicle.
pub fn desired_spacing(part: Spacing, p: &Parameters, x: [f64; 3]) -> f64 {
    spacing::pick(part)(p, &perceived(x))
}

/// The command, and whether it is feasible.
pub fn commanded_acceleration(part: Controller, p: &Parameters, x: [f64; 3], s_des: f64, v_f: f64) -> (f64, bool) {
    let command = controller::pick(part)(p, &perceived(x), s_des, v_f);
    (command.a_cmd, command.feasible)
}

/// Of the command and v_f, a_f, m_0, phi_f, dt.
pub fn vehicle_response(part: Dynamics, p: &Parameters, a_cmd: f64, ego: [f64; 5], sin_grade: f64) -> f64 {
    let [v_f, a_f, m_0, phi_f, dt] = ego;
    let road = Road { sin_grade, a_dp: f64::NAN, a_ap: f64::NAN };
    dynamics::pick(part)(p, a_cmd, &Ego { v_f, a_f, m_0, phi_f, dt }, &road)
}

/// Of the acceleration and its bounds a_dp and a_ap.
pub fn constrained_acceleration(part: Constraint, a: f64, [a_dp, a_ap]: [f64; 2]) -> f64 {
    constraint::pick(part)(a, &Road { sin_grade: f64::NAN, a_dp, a_ap })
}
