//! A constant deceleration while the car moves, which the controller does not compensate: rolling resistance.
//! in short: a constant resistance is not compensated
//! equation: a = a - c0
//! looks like: missing acceleration of one size at all speeds
//! confounded with: d_0
//! sign: positive
struct Parameters {
    /// deceleration [m/s2], -0.5 to 0.5, neutral 0
    c0: f32,
}

fn const_decel_response(own: Parameters, w: World, a: f32) -> f32 {
    return a - select(0.0, own.c0, w.v_f > 0.0);
}
