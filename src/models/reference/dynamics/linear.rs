use super::{Ego, Road};
use crate::symbols::Parameters;

/// Eq. 10 by one implicit Euler step: acceleration behind a first-order actuation lag \[m/s²\].
pub fn vehicle_response(p: &Parameters, a_cmd: f64, ego: &Ego, _road: &Road) -> f64 {
    let r = p.tau_a / ego.dt;
    (r * ego.a_f + a_cmd) / (1.0 + r)
}
