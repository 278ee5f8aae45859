// The simulated state: spacing [m], speed [m/s], acceleration [m/s2]. The spacing is a separate state and not the difference of two
// positions kilometres away, which f32 could not distinguish.
struct Motion {
    s: f32,
    v_f: f32,
    a_f: f32,
}

// The state at a measured sample.
fn at_rest_in(s: f32, v_f: f32, a_f: f32) -> Motion {
    return Motion(s, v_f, a_f);
}

// Eq. 1: the state one step dt [s] later, while the preceding vehicle drives dx_l [m]. A car does not roll backwards; its acceleration is
// then the one that stops it.
fn moved(now: Motion, a: f32, dx_l: f32, dt: f32) -> Motion {
    let per_dt = 1.0 / dt;
    let half_dt = 0.5 * dt;
    let v_free = now.v_f + a * dt;
    let v_next = max(v_free, 0.0);
    let a_next = select(a, -now.v_f * per_dt, v_free < 0.0);
    return Motion(now.s + (dx_l - (now.v_f + v_next) * half_dt), v_next, a_next);
}
