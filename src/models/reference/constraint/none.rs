use super::Road;

/// Eq. 12: no constraint \[m/s²\].
pub fn constrained_acceleration(a: f64, _road: &Road) -> f64 {
    a
}
