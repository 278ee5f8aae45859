//! Optimal velocity model: the speed relaxes to one that depends on the net spacing alone.
//! reference: Bando, Hasebe, Nakayama, Shibata, Sugiyama (1995); Treiber, Kesting (2013), Sec. 10.6
struct Parameters {
    v_0: f32,
    /// rate of the relaxation to the optimal speed [1/s], 0.01 to 10
    kappa: f32,
    /// spacing over which the optimal speed rises [m], 1 to 100
    ds: f32,
    /// spacing of the steepest rise, in units of ds [-], 0 to 5
    beta: f32,
}

// V(s) = v_0 (tanh(s / ds - beta) + tanh(beta)) / (1 + tanh(beta)) [m/s]: Treiber and Kesting's function with its hyperbolic tangents
// written as exponentials, of which these two remain. Behind the preceding vehicle they stay finite, too.
fn optimal_speed(own: Parameters, s: f32) -> f32 {
    let away = max(2.0 * s / own.ds, -40.0);
    return own.v_0 * (1.0 - exponential(-away)) / (1.0 + exponential(2.0 * own.beta - away));
}

// Bando et al.: the sensitivity times the deficit of the speed.
fn ovm_law(own: Parameters, x: Perceived) -> f32 {
    return own.kappa * (optimal_speed(own, x.s) - x.v_f);
}

// V(s) = v solved for s; near v_0, without a solution, that of 0.999 v_0.
fn ovm_equilibrium(own: Parameters, v: f32) -> f32 {
    let share = clamp(v / own.v_0, 0.0, 0.999);
    return 0.5 * own.ds * logarithm((1.0 + share * exponential(2.0 * own.beta)) / (1.0 - share));
}
