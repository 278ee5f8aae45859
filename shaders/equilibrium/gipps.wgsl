// Spacing at which a Gipps car at constant speed v behind another at that speed does not change it [m], Eq. 8.
fn equilibrium_spacing(p: Params, v: f32) -> f32 {
    return p.d_0 + (p.t_h + p.theta) * v + 0.5 * v * v * (1.0 / p.a_hat_min - 1.0 / p.a_min);
}
