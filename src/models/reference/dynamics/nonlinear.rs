use super::{Ego, Road};
use crate::symbols::Parameters;

/// Standard gravity g \[m/s²\].
const G: f64 = 9.80665;

/// Eq. 11: acceleration behind an actuation lag of the tractive force, with road loads \[m/s²\].
pub fn vehicle_response(p: &Parameters, a_cmd: f64, ego: &Ego, road: &Road) -> f64 {
    let m_f = ego.m_0 + p.m_load;
    let cos_grade = (1.0 - road.sin_grade.powi(2)).sqrt();
    let rolling_and_air = p.f_0 * cos_grade + p.f_1 * ego.v_f + p.f_2 * ego.v_f.powi(2);
    let resistance = rolling_and_air / m_f + G * road.sin_grade;
    let a_t = ego.phi_f * ego.a_f + resistance;
    let r = p.tau_a / ego.dt;
    let a_t = (r * a_t + a_cmd) / (1.0 + r);
    (a_t - resistance) / ego.phi_f
}
