// Desired spacing of the spacing policy at constant speed v behind a car at that speed [m].
fn equilibrium_spacing(p: Params, v: f32) -> f32 {
    return desired_spacing(p, Perceived(0.0, v, v));
}
