//! A tent over a speed, where more than 0.15 m/s2 is commanded.
//! tool: flexible term of a diagnosis
struct Parameters {
    /// acceleration in the middle of the tent [m/s2], -5 to 5, neutral 0
    thrust_a: f32,
    /// speed in the middle [m/s], 0 to 100
    thrust_v: f32,
    /// half its width [m/s], 0.1 to 100
    thrust_w: f32,
}

fn probe_thrust_response(own: Parameters, w: World, a: f32) -> f32 {
    let tent = own.thrust_a * max(1.0 - abs(w.v_f - own.thrust_v) / own.thrust_w, 0.0);
    return a + select(0.0, tent, a > 0.15);
}
