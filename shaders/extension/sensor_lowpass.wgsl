//! Spacing and speed difference pass a first-order filter; the own speed does not.
//! family: phase
//! looks like: residuals that follow the changes of the speed ahead, late and smoothed
//! confounded with: actuation_lag, perception_delay, time_offset
struct Parameters {
    /// time constant of the filter [s], 0 to 2.5, neutral 0
    tf: f32,
}

struct State {
    /// filtered spacing [m], starts at s
    gap: f32,
    /// filtered speed difference [m/s], starts at 0
    dv: f32,
}

struct Filtered {
    x: Perceived,
    state: State,
}

fn sensor_lowpass_perception(own: Parameters, state: State, w: World, x: Perceived) -> Filtered {
    // Backward Euler: what rises steadily comes through tf late exactly, and at tf = 0 at once.
    let share = w.dt / (own.tf + w.dt);
    // Opaque, or Mesa takes the terms in another order.
    let gap = opaque(state.gap + share * opaque(x.s - state.gap));
    let change = opaque(opaque(x.v_l - x.v_f) - state.dv);
    let dv = opaque(state.dv + share * change);
    return Filtered(Perceived(gap, x.v_f, x.v_f + dv), State(gap, dv));
}
