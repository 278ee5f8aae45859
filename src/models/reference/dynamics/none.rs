use super::{Ego, Road};
use crate::symbols::Parameters;

/// Eq. 9: the command is the acceleration \[m/s²\].
pub fn vehicle_response(_p: &Parameters, a_cmd: f64, _ego: &Ego, _road: &Road) -> f64 {
    a_cmd
}
