//! The law reads all signals slightly ahead of time, to represent the finer integration step of the real car.
//! tool: nuisance parameter of a diagnosis
struct Parameters {
    /// how far ahead the law reads [s], 0 to 0.05, neutral 0
    lead_h: f32,
}

fn lead_perception(own: Parameters, w: World, x: Perceived) -> Perceived {
    return Perceived(x.s + own.lead_h * (x.v_l - x.v_f), x.v_f + own.lead_h * w.a_f, x.v_l + own.lead_h * w.a_l);
}

fn lead_speed(own: Parameters, w: World, v_f: f32) -> f32 {
    return v_f + own.lead_h * w.a_f;
}
