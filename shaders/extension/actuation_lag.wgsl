//! The acceleration follows the command with time constant ta.
//! family: phase
//! looks like: residuals that follow the changes of the command, late and smoothed
//! confounded with: perception_delay, asym_lag, sensor_lowpass
//! reference: He, Montanino, Mattas, Punzo, Ciuffo, Eq. 10
struct Parameters {
    /// time constant of the actuator [s], 0 to 2.5, neutral 0
    ta: f32,
}

struct State {
    /// acceleration that the actuator makes [m/s2], starts at a_f
    a: f32,
}

struct Lagged {
    a: f32,
    state: State,
}

fn actuation_lag_command(own: Parameters, state: State, w: World, a_cmd: f32) -> Lagged {
    // 1 - exp(-dt/ta) to third order, for a command that is constant over the step; below dt/2 it passes at once.
    let share = min(w.dt / (own.ta + 0.5 * w.dt), 1.0);
    let next = state.a + share * (a_cmd - state.a);
    return Lagged(next, State(next));
}
