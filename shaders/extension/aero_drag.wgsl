//! Deceleration cD v^2 that the controller does not compensate.
//! in short: air drag or head wind is not compensated
//! equation: a = a - cD v^2
//! family: drag_or_headway
//! looks like: missing acceleration that grows with the square of the speed
//! confounded with: speed_dep_headway, t_h, d_0
//! sign: positive
//! experiment: driving without a car ahead at several set speeds: drag lowers the speed that is kept, a headway does not act there
struct Parameters {
    /// drag per mass [1/m], -0.002 to 0.002, neutral 0
    cD: f32,
}

fn aero_drag_response(own: Parameters, w: World, a: f32) -> f32 {
    return a - own.cD * w.v_f * w.v_f;
}
