// Eqs. 4 and 5: commanded acceleration of Gipps' model [m/s2]; infeasible if the radicand is negative.
fn commanded_acceleration(p: Params, x: Perceived, s_des: f32, v_f: f32) -> Command {
    let per_v_0 = 1.0 / p.v_0;
    let per_t_h = 1.0 / p.t_h;
    let per_a_hat_min = 1.0 / p.a_hat_min;
    let gain = 2.5 * p.a_max * p.t_h;
    let share = x.v_f * per_v_0;
    let free = x.v_f + gain * (1.0 - share) * sqrt(max(0.025 + share, 0.0));
    let h = 0.5 * p.t_h + p.theta;
    let room = 2.0 * (x.s - p.d_0) - p.t_h * x.v_f - x.v_l * x.v_l * per_a_hat_min;
    let radicand = p.a_min * p.a_min * h * h - p.a_min * room;
    let safe = p.a_min * h + sqrt(max(radicand, 0.0));
    let v_cmd = min(free, safe);
    // Rounding alone may make a radicand of zero slightly negative; below this, no speed is safe [m2/s2].
    return Command((v_cmd - v_f) * per_t_h, radicand >= -1e-10);
}
