// Eq. 6: commanded acceleration of the linear control law [m/s2].
fn commanded_acceleration(p: Params, x: Perceived, s_des: f32, v_f: f32) -> Command {
    let dv = x.v_l - x.v_f;
    let ds = s_des - x.s;
    return Command(min(p.k_v * dv - p.k_s * ds, p.k_0 * (p.v_0 - x.v_f)), true);
}
