//! Adds ki times the integral of the spacing error to the command, at most 0.6 m/s2.
//! in short: lasting errors of the gap are corrected
//! equation: a_cmd = a_cmd + ki int(ds) dt
//! looks like: spacing errors that fade out over minutes, or swing slowly
//! confounded with: headway_mode_change, const_decel
//! search: integral
//! sign: positive
struct Parameters {
    /// gain of the integral [1/s3], -0.02 to 0.06, neutral 0
    ki: f32,
}

struct State {
    /// integral of the spacing error [m s], starts at 0
    integral: f32,
}

struct Integrated {
    x: Perceived,
    state: State,
}

// Largest part of the command that is due to the integral [m/s2].
const LIMIT: f32 = 0.6;

fn integral_action_perception(p: Params, own: Parameters, state: State, w: World, x: Perceived) -> Integrated {
    // Opaque, because Mesa would reorder the terms.
    let error = opaque(x.s - equilibrium_spacing(p, x.v_f));
    let part = own.ki * state.integral;
    // The integral waits while its part is at its limit.
    let waits = abs(part) >= LIMIT && part * error * own.ki > 0.0;
    return Integrated(x, State(state.integral + opaque(select(error * w.dt, 0.0, waits))));
}

fn integral_action_command(own: Parameters, state: State, a_cmd: f32) -> f32 {
    return a_cmd + clamp(own.ki * state.integral, -LIMIT, LIMIT);
}
