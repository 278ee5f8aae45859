//! Krauss' model without its random part: the largest speed from which the car can still stop behind the preceding one.
//! Commands a speed, counted from the present own speed. d_0 is SUMO's minGap, which is taken off the spacing.
//! reference: Krauss (1998); SUMO, KraussOrig1, sigma = 0
struct Parameters {
    v_0: f32,
    d_0: f32,
    t_h: f32,
    a_max: f32,
    a_min: f32,
}

fn krauss_law(own: Parameters, w: World, x: Perceived, v_f: f32) -> f32 {
    let b = -own.a_min;
    let react = b * own.t_h;
    // v_safe = -b tau + sqrt((b tau)^2 + v_l^2 + 2 b g) with the gap g: the distance driven in tau and while braking equals g plus the
    // leader's braking distance.
    let radicand = opaque(react * react + x.v_l * x.v_l) + 2.0 * b * (x.s - own.d_0);
    let safe = sqrt(max(radicand, 0.0)) - react;
    // The smallest of v_0, v + a_max dt and v_safe, and never below 0.
    let v_next = max(min(min(own.v_0, v_f + own.a_max * w.dt), safe), 0.0);
    return (v_next - v_f) / w.dt;
}

// v_safe = v.
fn krauss_equilibrium(own: Parameters, v: f32) -> f32 {
    return own.d_0 + own.t_h * v;
}
