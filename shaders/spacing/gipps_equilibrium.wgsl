// Eq. 8: desired spacing of Gipps' model at equilibrium [m].
fn desired_spacing(p: Params, x: Perceived) -> f32 {
    let headway = p.t_h + p.theta;
    let curvature = 0.5 * (1.0 / p.a_min - 1.0 / p.a_hat_min);
    return p.d_0 + headway * x.v_f - x.v_f * x.v_f * curvature;
}
