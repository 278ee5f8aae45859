//! Improved Intelligent Driver Model: in equilibrium it keeps the desired spacing at every speed up to v_0.
//! reference: Treiber, Kesting (2013), Sec. 11.3.7
struct Parameters {
    delta: f32,
    v_0: f32,
    d_0: f32,
    t_h: f32,
    a_max: f32,
    a_min: f32,
}

// z = s* / s, with the desired spacing s* of the IDM. A spacing of 1 mm is the smallest that is read.
fn closeness(own: Parameters, x: Perceived) -> f32 {
    let brake = 1.0 / (2.0 * sqrt(-own.a_max * own.a_min));
    let dv = x.v_l - x.v_f;
    let desired = own.d_0 + max(own.t_h * x.v_f - x.v_f * dv * brake, 0.0);
    return desired / max(x.s, 0.001);
}

// a_free: a_max (1 - (v / v_0)^delta) up to v_0, a_min (1 - (v_0 / v)^(a_max delta / -a_min)) above.
fn free(own: Parameters, v: f32) -> f32 {
    let per_v_0 = 1.0 / own.v_0;
    let slower = own.a_max * (1.0 - power(v * per_v_0, own.delta));
    let faster = own.a_min * (1.0 - power(own.v_0 / max(v, own.v_0), own.a_max * own.delta / -own.a_min));
    return select(faster, slower, v <= own.v_0);
}

fn iidm_law(own: Parameters, x: Perceived) -> f32 {
    let z = closeness(own, x);
    let a_free = free(own, x.v_f);
    // Too close, z at least 1.
    let pushed = own.a_max * (1.0 - z * z);
    // Far enough, z below 1: a_free (1 - z^(2 a_max / a_free)). At v_0 itself the exponent is as good as infinite.
    let eased = a_free * (1.0 - power(min(z, 1.0), 2.0 * own.a_max / max(a_free, 1e-12)));
    let slower = select(pushed, eased, z < 1.0);
    // Above v_0.
    let faster = select(a_free + pushed, a_free, z < 1.0);
    return select(faster, slower, x.v_f <= own.v_0);
}

// z = 1; above v_0 there is no equilibrium, and the braking grows from here.
fn iidm_equilibrium(own: Parameters, v: f32) -> f32 {
    return own.d_0 + own.t_h * v;
}
