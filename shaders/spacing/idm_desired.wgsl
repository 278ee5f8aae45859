// Eq. 3: desired spacing of the IDM [m].
fn desired_spacing(p: Params, x: Perceived) -> f32 {
    let brake = 1.0 / (2.0 * sqrt(-p.a_max * p.a_min));
    let dv = x.v_l - x.v_f;
    return p.d_0 + max(p.t_h * x.v_f - x.v_f * dv * brake, 0.0);
}
