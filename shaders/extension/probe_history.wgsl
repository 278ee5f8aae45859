//! A tent over the command and its change over the last second: hysteresis, gear changes, memory.
//! tool: flexible term of a diagnosis
struct Parameters {
    /// acceleration in the middle of the tent [m/s2], -5 to 5, neutral 0
    history_a: f32,
    /// command in the middle [m/s2], -100 to 100
    history_c: f32,
    /// half its width [m/s2], 0.01 to 100
    history_c_w: f32,
    /// change in the middle [m/s2], -100 to 100
    history_d: f32,
    /// half its width [m/s2], 0.01 to 100
    history_d_w: f32,
}

struct State {
    /// command, filtered over 1 s [m/s2], starts at a_f
    slow: f32,
}

struct Changed {
    a: f32,
    state: State,
}

fn probe_history_response(own: Parameters, state: State, w: World, a: f32) -> Changed {
    let change = a - state.slow;
    let tent = max(1.0 - abs(a - own.history_c) / own.history_c_w, 0.0);
    let both = tent * max(1.0 - abs(change - own.history_d) / own.history_d_w, 0.0);
    return Changed(a + own.history_a * both, State(state.slow + min(w.dt / (1.0 + 0.5 * w.dt), 1.0) * change));
}
