//! Full velocity difference model: the optimal velocity model with a term for the speed difference.
//! reference: Jiang, Wu, Zhu (2001); Treiber, Kesting (2013), Secs. 10.6 and 10.7
struct Parameters {
    v_0: f32,
    /// rate of the relaxation to the optimal speed [1/s], 0.01 to 10
    kappa: f32,
    /// gain for the speed difference [1/s], 0 to 5
    lambda: f32,
    /// spacing over which the optimal speed rises [m], 1 to 100
    ds: f32,
    /// spacing of the steepest rise, in units of ds [-], 0 to 5
    beta: f32,
}

// As in ovm.wgsl.
fn optimal_speed(own: Parameters, s: f32) -> f32 {
    let away = max(2.0 * s / own.ds, -40.0);
    return own.v_0 * (1.0 - exponential(-away)) / (1.0 + exponential(2.0 * own.beta - away));
}

// Jiang, Wu and Zhu: the first term is the optimal velocity model.
fn fvdm_law(own: Parameters, x: Perceived) -> f32 {
    return own.kappa * (optimal_speed(own, x.s) - x.v_f) + own.lambda * (x.v_l - x.v_f);
}

// As in ovm.wgsl: the speed difference is 0.
fn fvdm_equilibrium(own: Parameters, v: f32) -> f32 {
    let share = clamp(v / own.v_0, 0.0, 0.999);
    return 0.5 * own.ds * logarithm((1.0 + share * exponential(2.0 * own.beta)) / (1.0 - share));
}
