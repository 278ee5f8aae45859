//! Newell's model: the way of the preceding vehicle, tau later and d_0 behind, or the way at v_0. Commands a speed.
//! reference: Newell (2002)
//! loop: look back by tau
struct Parameters {
    v_0: f32,
    d_0: f32,
    /// time by which the way of the preceding vehicle is driven later [s], 0.1 to 5
    tau: f32,
}

fn newell_law(own: Parameters, w: World, x: Perceived, v_f: f32) -> f32 {
    // The displacement of the preceding vehicle in the last tau, by Simpson's rule as in extension/time_offset.wgsl.
    let sum = opaque(opaque(x.v_l + w.v_l_then) + 4.0 * w.v_l_half);
    let way = own.tau / 6.0 * sum;
    // Newell: x(t) = x_l(t - tau) - d_0. A measured car does not start there, so it closes the remaining distance within tau. Without
    // tau, as in the theory, no car with a lag could follow.
    let ahead = opaque(opaque(x.s - own.d_0) - way);
    let v_next = min(own.v_0, w.v_l_then + ahead / own.tau);
    return (v_next - v_f) / w.dt;
}

// The preceding vehicle is ahead by d_0 plus the distance driven in tau.
fn newell_equilibrium(own: Parameters, v: f32) -> f32 {
    return own.d_0 + own.tau * v;
}
