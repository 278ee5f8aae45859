// Eq. 13: constant bounds [m/s2]; a_lb = -7 and a_ub = 5: paper, Section 2.2.2.
fn constrained_acceleration(a: f32, road: Road) -> f32 {
    return min(max(a, -7.0), 5.0);
}
