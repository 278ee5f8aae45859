//! Spacing and speed difference pass a first-order filter; the own speed does not.
//! in short: gap and speed difference are filtered
//! equation: d(s, dv)/dt = (measured - filtered) / tf
//! family: phase
//! looks like: residuals that follow the changes of the speed ahead, late and smoothed
//! confounded with: actuation_lag, perception_delay, time_offset
//! experiment: a leader that brakes and accelerates at once and hard, under sensors with little noise: a delay shifts the response, a lag or
//! filter rounds it
struct Parameters {
    /// time constant of the filter [s], 0 to 2.5, neutral 0
    tf: f32,
}

struct State {
    /// filtered spacing at the beginning of a step [m], starts at s
    gap: f32,
    /// filtered speed difference there [m/s], starts at 0
    dv: f32,
}

struct Filtered {
    x: Perceived,
    state: State,
}

fn sensor_lowpass_perception(own: Parameters, state: State, w: World, x: Perceived) -> Filtered {
    // As in actuation_lag.wgsl; the perceived value is the mean of both ends of the step.
    let half = 0.5 * w.dt / (own.tf + 0.5 * w.dt);
    // Opaque, because Mesa would reorder the terms.
    let gap_rise = opaque(half * opaque(x.s - state.gap));
    let dv_rise = opaque(half * opaque(opaque(x.v_l - x.v_f) - state.dv));
    let gap = opaque(state.gap + gap_rise);
    let dv = opaque(state.dv + dv_rise);
    return Filtered(Perceived(gap, x.v_f, x.v_f + dv), State(gap + gap_rise, dv + dv_rise));
}
