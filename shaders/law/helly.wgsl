//! Helly's linear law: the desired spacing depends on the own speed and on the own present acceleration.
//! reference: Helly (1959)
struct Parameters {
    k_s: f32,
    k_v: f32,
    d_0: f32,
    t_h: f32,
    /// growth of the desired spacing with the own acceleration [s2], -1 to 3
    gamma: f32,
}

fn helly_law(own: Parameters, w: World, x: Perceived) -> f32 {
    // D = alpha + beta v + gamma a: alpha is d_0, beta is t_h.
    let desired = opaque(own.d_0 + own.t_h * x.v_f + own.gamma * w.a_f);
    // C_1 (v_l - v) + C_2 (s - D)
    return own.k_v * (x.v_l - x.v_f) + own.k_s * opaque(x.s - desired);
}

// s = D without acceleration; no speed is too high.
fn helly_equilibrium(own: Parameters, v: f32) -> f32 {
    return own.d_0 + own.t_h * v;
}
