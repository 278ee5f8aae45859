//! The command changes by at most J.
//! in short: the command changes only so fast
//! equation: |da_cmd/dt| <= J
//! looks like: residuals at the beginning and end of hard manoeuvres
//! confounded with: actuation_lag, integral_action, quantised_accel
//! search: limit
//! scale: ratio
//! experiment: a leader that drives off fast and brakes hard, both abruptly and gently, from low and from high speed: a limit of the
//! power falls with the speed, one of the jerk acts at the beginning only
struct Parameters {
    /// largest change of the command [m/s3], 0.1 to 8, neutral 8
    J: f32,
}

struct State {
    /// command as given on [m/s2], starts at a_f
    command: f32,
}

struct Limited {
    a: f32,
    state: State,
}

fn jerk_limit_command(own: Parameters, state: State, w: World, a_cmd: f32) -> Limited {
    let most = own.J * w.dt;
    let command = state.command + clamp(a_cmd - state.command, -most, most);
    return Limited(command, State(command));
}
