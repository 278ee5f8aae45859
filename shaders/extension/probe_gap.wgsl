//! A tent over time gap and speed.
//! tool: flexible term of a diagnosis
struct Parameters {
    /// acceleration in the middle of the tent [m/s2], -5 to 5, neutral 0
    gap_a: f32,
    /// time gap in the middle [s], 0 to 100
    gap_t: f32,
    /// half its width [s], 0.01 to 100
    gap_t_w: f32,
    /// speed in the middle [m/s], 0 to 100
    gap_v: f32,
    /// half its width [m/s], 0.1 to 100
    gap_v_w: f32,
}

fn probe_gap_response(own: Parameters, w: World, a: f32) -> f32 {
    let time_gap = w.s / max(w.v_f, 1.0);
    let tent = max(1.0 - abs(time_gap - own.gap_t) / own.gap_t_w, 0.0);
    return a + own.gap_a * tent * max(1.0 - abs(w.v_f - own.gap_v) / own.gap_v_w, 0.0);
}
