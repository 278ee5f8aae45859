// One simulated step of a model with extensions; step.wgsl is the one without them.
struct Step {
    next: Motion,
    // Memory of the extensions.
    memory: Memory,
    // Acceleration before the constraint [m/s2].
    a_free: f32,
    // Acceleration after the constraint [m/s2].
    a: f32,
    // False where Gipps' radicand is negative.
    feasible: bool,
}

// The order of the paper, each extension right after the stage that it changes (`stage_...` are generated and call them).
// `driven` is generated, too: an observer's missing acceleration is added after the model and is not part of its a_f.
fn step(
    p: Params, x: Perceived, now: Motion, memory: Memory, m_0: f32, phi_f: f32, road: Road, given: Given, dx_l: f32, dt: f32,
) -> Step {
    let w = World(
        given.t, dt, given.x_f, road.sin_grade, now.s, now.v_f, now.a_f, given.a_l, given.v_l2, given.s_l2,
        given.v_l_then, given.v_l_half,
    );
    let policy = stage_policy(p, p, w, x, memory);
    let q = policy.value;
    let perception = stage_perception(p, q, w, x, policy.memory);
    let seen = perception.value;
    let s_des = desired_spacing(q, seen);
    let own = stage_speed(p, q, w, seen, now.v_f, perception.memory);
    let command = commanded_acceleration(q, seen, s_des, own.value);
    let law = stage_law(p, q, w, seen, command.a_cmd, own.memory);
    let wanted = stage_command(p, q, w, seen, law.value, law.memory);
    let ego = Ego(now.v_f, now.a_f, m_0, phi_f, dt);
    let response = stage_response(p, q, w, seen, vehicle_response(q, wanted.value, ego, road), wanted.memory);
    let a_free = response.value;
    let a = constrained_acceleration(a_free, road);
    let next = driven(now, a, memory, dx_l, dt);
    return Step(next, forgetting(p, response.memory), a_free, a, command.feasible);
}
