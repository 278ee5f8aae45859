// Eq. 10 by one implicit Euler step: acceleration behind a first-order actuation lag [m/s2].
fn vehicle_response(p: Params, a_cmd: f32, ego: Ego, road: Road) -> f32 {
    let r = p.tau_a / ego.dt;
    let per_step = 1.0 / (1.0 + r);
    return (r * ego.a_f + a_cmd) * per_step;
}
