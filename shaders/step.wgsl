// One simulated step.
struct Step {
    next: Motion,
    // Acceleration before the constraint [m/s2]; it is checked for NaN and infinity there, because a clamp would hide them.
    a_free: f32,
    // Acceleration after the constraint [m/s2].
    a: f32,
    // False where Gipps' radicand is negative.
    feasible: bool,
}

// The order of the paper: spacing policy, controller, dynamics, constraint, then Eq. 1. `dx_l` is the distance [m] that
// the preceding vehicle covers in the step `dt` [s]; m_0 [kg] and phi_f belong to the ego vehicle.
fn step(p: Params, x: Perceived, now: Motion, m_0: f32, phi_f: f32, road: Road, dx_l: f32, dt: f32) -> Step {
    let s_des = desired_spacing(p, x);
    let command = commanded_acceleration(p, x, s_des, now.v_f);
    let ego = Ego(now.v_f, now.a_f, m_0, phi_f, dt);
    let a_free = vehicle_response(p, command.a_cmd, ego, road);
    let a = constrained_acceleration(a_free, road);
    return Step(moved(now, a, dx_l, dt), a_free, a, command.feasible);
}
