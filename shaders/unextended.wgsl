// For a model without extensions and without an observer: no memory and no look-ups.
struct Memory {
    nothing: f32,
}

struct Given {
    t: f32,
    x_f: f32,
    a_l: f32,
    v_l2: f32,
    s_l2: f32,
    v_l_then: f32,
    v_l_half: f32,
}

struct Stepped {
    next: Motion,
    memory: Memory,
    a_free: f32,
    a: f32,
    feasible: bool,
}

fn stepped(
    p: Params, x: Perceived, now: Motion, memory: Memory, m_0: f32, phi_f: f32, road: Road, given: Given, dx_l: f32,
    dt: f32,
) -> Stepped {
    let done = step(p, x, now, m_0, phi_f, road, dx_l, dt);
    return Stepped(done.next, memory, done.a_free, done.a, done.feasible);
}

fn set_zeros(even: u32, odd: u32) {
}
