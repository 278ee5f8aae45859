// Eq. 11: acceleration behind an actuation lag of the tractive force, with road loads [m/s2].
fn vehicle_response(p: Params, a_cmd: f32, ego: Ego, road: Road) -> f32 {
    // 9.80665 m/s2: standard gravity.
    let per_m_f = 1.0 / (ego.m_0 + p.m_load);
    let per_phi_f = 1.0 / ego.phi_f;
    let cos_grade = sqrt(max(1.0 - road.sin_grade * road.sin_grade, 0.0));
    let rolling_and_air = p.f_0 * cos_grade + p.f_1 * ego.v_f + p.f_2 * ego.v_f * ego.v_f;
    let resistance = rolling_and_air * per_m_f + 9.80665 * road.sin_grade;
    let r = p.tau_a / ego.dt;
    let per_step = 1.0 / (1.0 + r);
    let a_t = (r * (ego.phi_f * ego.a_f + resistance) + a_cmd) * per_step;
    return (a_t - resistance) * per_phi_f;
}
