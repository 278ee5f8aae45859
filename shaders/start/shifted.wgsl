// The spacing at a sample before the first simulated one [m] (convention `radicand=shifted`, Gipps only): where the
// radicand of Eq. 5 is negative, the spacing at which it is zero.
fn starting_spacing(p: Params, x: Perceived) -> f32 {
    let h = 0.5 * p.t_h + p.theta;
    let per_a_hat_min = 1.0 / p.a_hat_min;
    let brake = x.v_f * p.t_h + x.v_l * x.v_l * per_a_hat_min;
    let room = x.s - p.d_0;
    let radicand = p.a_min * p.a_min * h * h - p.a_min * (2.0 * room - brake);
    let shifted = p.d_0 + 0.5 * (p.a_min * h * h + brake);
    return select(x.s, shifted, radicand < 0.0);
}
