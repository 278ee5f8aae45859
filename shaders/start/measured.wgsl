// The spacing at a sample before the first simulated one, as measured [m] (convention `radicand=measured`).
fn starting_spacing(p: Params, x: Perceived) -> f32 {
    return x.s;
}
