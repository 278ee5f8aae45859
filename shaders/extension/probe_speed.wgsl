//! A tent over a speed.
//! tool: flexible term of a diagnosis
struct Parameters {
    /// acceleration in the middle of the tent [m/s2], -5 to 5, neutral 0
    speed_a: f32,
    /// speed in the middle [m/s], 0 to 100
    speed_v: f32,
    /// half its width [m/s], 0.1 to 100
    speed_w: f32,
}

fn probe_speed_response(own: Parameters, w: World, a: f32) -> f32 {
    return a + own.speed_a * max(1.0 - abs(w.v_f - own.speed_v) / own.speed_w, 0.0);
}
