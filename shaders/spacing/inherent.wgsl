// Gipps' controller contains its own spacing policy and reads none.
fn desired_spacing(p: Params, x: Perceived) -> f32 {
    return 0.0;
}
