//! ACC model: the IIDM, whose braking is eased where the constant-acceleration heuristic (CAH) needs less.
//! reference: Kesting, Treiber, Helbing (2010), with the IIDM in place of the IDM as in Treiber, Kesting (2013), Sec. 11.3.8
struct Parameters {
    delta: f32,
    v_0: f32,
    d_0: f32,
    t_h: f32,
    a_max: f32,
    a_min: f32,
    /// weight of the heuristic: 0 is the IIDM [-], 0 to 1
    coolness: f32,
}

// As in iidm.wgsl.
fn closeness(own: Parameters, x: Perceived) -> f32 {
    let brake = 1.0 / (2.0 * sqrt(-own.a_max * own.a_min));
    let dv = x.v_l - x.v_f;
    let desired = own.d_0 + max(own.t_h * x.v_f - x.v_f * dv * brake, 0.0);
    return desired / max(x.s, 0.001);
}

// As in iidm.wgsl.
fn free(own: Parameters, v: f32) -> f32 {
    let per_v_0 = 1.0 / own.v_0;
    let slower = own.a_max * (1.0 - power(v * per_v_0, own.delta));
    let faster = own.a_min * (1.0 - power(own.v_0 / max(v, own.v_0), own.a_max * own.delta / -own.a_min));
    return select(faster, slower, v <= own.v_0);
}

// a_IIDM, as in iidm.wgsl.
fn iidm(own: Parameters, x: Perceived) -> f32 {
    let z = closeness(own, x);
    let a_free = free(own, x.v_f);
    let pushed = own.a_max * (1.0 - z * z);
    let eased = a_free * (1.0 - power(min(z, 1.0), 2.0 * own.a_max / max(a_free, 1e-12)));
    let slower = select(pushed, eased, z < 1.0);
    let faster = select(a_free + pushed, a_free, z < 1.0);
    return select(faster, slower, x.v_f <= own.v_0);
}

// a_CAH: the largest acceleration that does not lead to a crash while the preceding vehicle keeps its own, or a_max if that is less.
fn heuristic(own: Parameters, w: World, x: Perceived) -> f32 {
    let s = max(x.s, 0.001);
    let a_l = min(w.a_l, own.a_max);
    let twice = -2.0 * s * a_l;
    let apart = x.v_l * x.v_l + twice;
    // v_l (v - v_l) <= -2 s a_l: both cars stand before the gap is used up. Behind a standing vehicle `apart` may be 0; then the other case
    // is the limit.
    let stops = x.v_l * (x.v_f - x.v_l) <= twice && apart > 0.0;
    // v^2 a_l / (v_l^2 - 2 s a_l)
    let stopping = x.v_f * x.v_f * a_l / select(1.0, apart, stops);
    // a_l - (v - v_l)^2 / (2 s), without the second term where the gap opens.
    let closing = max(x.v_f - x.v_l, 0.0);
    let meeting = a_l - closing * closing / (2.0 * s);
    return select(meeting, stopping, stops);
}

fn acc_kesting_law(own: Parameters, w: World, x: Perceived) -> f32 {
    let a_iidm = iidm(own, x);
    let a_cah = heuristic(own, w, x);
    let b = -own.a_min;
    // (1 - c) a_IIDM + c (a_CAH + b tanh((a_IIDM - a_CAH) / b)) where the IIDM brakes more; tanh(y) = (e^2y - 1) / (e^2y + 1), y up to 0.
    let e = exponential(2.0 * min(a_iidm - a_cah, 0.0) / b);
    let cool = a_cah + b * ((e - 1.0) / (e + 1.0));
    // Opaque, because Mesa would make another interpolation of it.
    let eased = opaque(1.0 - own.coolness) * a_iidm + own.coolness * cool;
    return select(eased, a_iidm, a_iidm >= a_cah);
}

// That of the IIDM, because a_CAH is 0 there.
fn acc_kesting_equilibrium(own: Parameters, v: f32) -> f32 {
    return own.d_0 + own.t_h * v;
}
