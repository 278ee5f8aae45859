//! The command comes in steps of qz.
//! in short: the command comes in steps
//! equation: a_cmd in steps of qz
//! looks like: small sawtooth residuals wherever the command changes slowly
//! search: steps
struct Parameters {
    /// size of a step [m/s2], 0 to 1.2, neutral 0
    qz: f32,
}

struct State {
    /// command as given on [m/s2], starts at a_f
    a: f32,
}

struct Quantised {
    a: f32,
    state: State,
}

// Decrease of a command with the own speed [1/s], halved: laws have 0.6 to 4.
const FALL: f32 = 0.8;

fn quantised_accel_command(own: Parameters, state: State, w: World, a_cmd: f32) -> Quantised {
    // Between two steps a car switches back and forth in time steps finer than ours, because every step up lowers the command. On average it
    // keeps the command between the two. So the rounded value is the command less the effect of the response itself until the
    // middle of the time step. Solved for the response, this gives steps joined by slopes.
    let step = max(own.qz, 0.000001);
    let slope = FALL * w.dt;
    let x = opaque(opaque(a_cmd + opaque(slope * state.a)) / step + 0.5);
    let whole = floor(x / (1.0 + slope));
    let rest = opaque(x - opaque(whole * (1.0 + slope)));
    let rounded = (whole + max(rest - 1.0, 0.0) / slope) * step;
    let a = select(a_cmd, rounded, own.qz > 0.000001);
    return Quantised(a, State(a));
}
