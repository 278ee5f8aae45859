// Eq. 7: desired spacing at a constant time headway [m].
fn desired_spacing(p: Params, x: Perceived) -> f32 {
    return p.d_0 + p.t_h * x.v_f;
}
