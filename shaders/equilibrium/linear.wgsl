// Spacing at which a linear controller at constant speed v behind a car at that speed does not change it [m].
fn equilibrium_spacing(p: Params, v: f32) -> f32 {
    return desired_spacing(p, Perceived(0.0, v, v));
}
