//! ACC of Milanes and Shladover: one law for the speed, one for the gap, and between them a hysteresis; as in SUMO's ACC.
//! The hysteresis reads the gap as SUMO does, the spacing less d_0. The speed is not capped at v_0 where the gap law acts.
//! reference: Milanes, Shladover (2014); Xiao, Wang, van Arem (2017); Xiao, Wang, Schakel, van Arem (2018)
struct Parameters {
    k_s: f32,
    k_v: f32,
    k_0: f32,
    v_0: f32,
    d_0: f32,
    t_h: f32,
}

struct State {
    /// law used last: 1 for the gap, 0 for the speed [-], starts at 0
    follows: f32,
}

struct Commanded {
    a: f32,
    state: State,
}

// Addition of Xiao et al. (2018) to the desired gap at low speed [m]: 75 / v - 5, limited to 0 to 2 m; as in SUMO 1.28, without a jump at
// 10.8 m/s.
fn margin(v: f32) -> f32 {
    return clamp(75.0 / max(v, 1.0) - 5.0, 0.0, 2.0);
}

fn acc_milanes_law(own: Parameters, state: State, x: Perceived) -> Commanded {
    let gap = x.s - own.d_0;
    // Beyond 120 m the speed law, below 100 m the gap law, in between the one used last.
    let follows = select(select(state.follows, 1.0, gap < 100.0), 0.0, gap > 120.0);
    let by_speed = own.k_0 * (own.v_0 - x.v_f);
    let error = opaque(opaque(gap - own.t_h * x.v_f) - margin(x.v_f));
    let by_gap = own.k_v * (x.v_l - x.v_f) + own.k_s * error;
    return Commanded(select(by_speed, by_gap, follows > 0.5), State(follows));
}

// That of the gap law.
fn acc_milanes_equilibrium(own: Parameters, v: f32) -> f32 {
    return own.d_0 + own.t_h * v + margin(v);
}
