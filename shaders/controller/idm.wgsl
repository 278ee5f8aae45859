// Eq. 2: commanded acceleration of the IDM [m/s2].
fn commanded_acceleration(p: Params, x: Perceived, s_des: f32, v_f: f32) -> Command {
    let per_v_0 = 1.0 / p.v_0;
    let closeness = s_des / x.s;
    return Command(p.a_max * (1.0 - power(x.v_f * per_v_0, p.delta) - closeness * closeness), true);
}
