// Eq. 12: no constraint [m/s2].
fn constrained_acceleration(a: f32, road: Road) -> f32 {
    return a;
}
