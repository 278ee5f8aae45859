//! The acceleration follows the command with time constant ta for thrust and tb for braking.
//! in short: thrust and brakes follow with different lags
//! equation: da/dt = (a_cmd - a) / (ta or tb)
//! family: phase
//! looks like: residuals that follow the changes of the command, late, and more so on one side of zero
//! confounded with: actuation_lag
//! experiment: a leader that brakes and accelerates at once and hard, under sensors with little noise: a delay shifts the response, a lag or
//! filter rounds it
struct Parameters {
    /// time constant where the command is not below 0 [s], 0 to 4, neutral 0
    ta: f32,
    /// time constant where the command is below 0 [s], 0 to 4, neutral 0
    tb: f32,
}

struct State {
    /// acceleration that the actuator makes at the beginning of a step [m/s2], starts at a_f
    a: f32,
}

struct Lagged {
    a: f32,
    state: State,
}

fn asym_lag_command(own: Parameters, state: State, w: World, a_cmd: f32) -> Lagged {
    let lag = select(own.tb, own.ta, a_cmd >= 0.0);
    // As in actuation_lag.wgsl.
    let rise = a_cmd - state.a;
    let half = 0.5 * w.dt / (lag + 0.5 * w.dt);
    return Lagged(state.a + half * rise, State(state.a + 2.0 * half * rise));
}
