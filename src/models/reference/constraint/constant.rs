use super::Road;

/// Eq. 13: constant bounds \[m/s²\].
pub fn constrained_acceleration(a: f64, _road: &Road) -> f64 {
    // a_lb = -7 and a_ub = 5: paper, Section 2.2.2.
    a.clamp(-7.0, 5.0)
}
