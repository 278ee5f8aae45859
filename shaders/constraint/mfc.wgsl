// Eq. 14: bounds that vary with speed [m/s2].
fn constrained_acceleration(a: f32, road: Road) -> f32 {
    return min(max(a, road.a_dp), road.a_ap);
}
