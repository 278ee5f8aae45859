//! A tent over speed difference and speed.
//! tool: flexible term of a diagnosis
struct Parameters {
    /// acceleration in the middle of the tent [m/s2], -5 to 5, neutral 0
    closing_a: f32,
    /// speed difference in the middle [m/s], -100 to 100
    closing_dv: f32,
    /// half its width [m/s], 0.01 to 100
    closing_dv_w: f32,
    /// speed in the middle [m/s], 0 to 100
    closing_v: f32,
    /// half its width [m/s], 0.1 to 100
    closing_v_w: f32,
}

fn probe_closing_response(own: Parameters, w: World, x: Perceived, a: f32) -> f32 {
    let tent = max(1.0 - abs(x.v_l - x.v_f - own.closing_dv) / own.closing_dv_w, 0.0);
    return a + own.closing_a * tent * max(1.0 - abs(w.v_f - own.closing_v) / own.closing_v_w, 0.0);
}
