//! The acceleration follows the command with time constant ta.
//! in short: the acceleration follows the command slowly
//! equation: da/dt = (a_cmd - a) / ta
//! family: phase
//! looks like: residuals that follow the changes of the command, late and smoothed
//! confounded with: perception_delay, asym_lag, sensor_lowpass
//! experiment: a leader that brakes and accelerates at once and hard, under sensors with little noise: a delay shifts the response, a lag or
//! filter rounds it
//! reference: He, Montanino, Mattas, Punzo, Ciuffo, Eq. 10
struct Parameters {
    /// time constant of the actuator [s], 0 to 2.5, neutral 0
    ta: f32,
}

struct State {
    /// acceleration that the actuator makes at the beginning of a step [m/s2], starts at a_f
    a: f32,
}

struct Lagged {
    a: f32,
    state: State,
}

fn actuation_lag_command(own: Parameters, state: State, w: World, a_cmd: f32) -> Lagged {
    // Trapezoidal rule: the step uses the mean of both ends. A steadily rising signal comes out exactly ta late, and without delay at
    // ta = 0.
    let rise = a_cmd - state.a;
    let half = 0.5 * w.dt / (own.ta + 0.5 * w.dt);
    return Lagged(state.a + half * rise, State(state.a + 2.0 * half * rise));
}
