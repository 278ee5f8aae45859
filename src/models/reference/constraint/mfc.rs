use super::Road;

/// Eq. 14: bounds that vary with speed \[m/s²\].
pub fn constrained_acceleration(a: f64, road: &Road) -> f64 {
    a.max(road.a_dp).min(road.a_ap)
}
