// The simulated state: spacing [m], speed [m/s], acceleration [m/s2]. Spacing and speed each carry the rounding error of f32 in a second
// word, so that rounding errors do not accumulate over ten thousand steps.
struct Motion {
    s: f32,
    v_f: f32,
    a_f: f32,
    s_low: f32,
    v_low: f32,
}

// A sum with its rounding error (Knuth's two-sum). `opaque` keeps a compiler from cancelling the error term.
struct Sum {
    high: f32,
    low: f32,
}

fn two_sum(a: f32, b: f32) -> Sum {
    let high = opaque(a + b);
    let b_seen = opaque(high - a);
    let a_seen = opaque(high - b_seen);
    return Sum(high, (a - a_seen) + (b - b_seen));
}

// The state at a measured sample.
fn at_rest_in(s: f32, v_f: f32, a_f: f32) -> Motion {
    return Motion(s, v_f, a_f, 0.0, 0.0);
}

// Eq. 1: the state one step dt [s] later, while the preceding vehicle drives dx_l [m]. A car does not roll backwards; its acceleration is
// then the one that stops it.
fn moved(now: Motion, a: f32, dx_l: f32, dt: f32) -> Motion {
    let per_dt = 1.0 / dt;
    let half_dt = 0.5 * dt;
    let v_free = two_sum(now.v_f, a * dt + now.v_low);
    let stops = v_free.high < 0.0;
    let v_next = max(v_free.high, 0.0);
    let v_low = select(v_free.low, 0.0, stops);
    let a_next = select(a, -now.v_f * per_dt, stops);
    let twice_v = two_sum(now.v_f, v_next);
    // Opaque, because Mesa would factor the terms.
    let driven = opaque(twice_v.high * half_dt) + (twice_v.low + (now.v_low + v_low)) * half_dt;
    let gained = two_sum(dx_l, -driven);
    let s = two_sum(now.s, gained.high + now.s_low);
    return Motion(s.high, v_next, a_next, s.low + gained.low, v_low);
}
