//! The command is at most acap.
//! in short: no stronger acceleration is asked for
//! equation: a_cmd <= acap
//! looks like: too little acceleration where much is wanted, at any speed
//! confounded with: power_cap
//! search: limit
//! scale: ratio
//! experiment: a leader that drives off fast and brakes hard, both abruptly and gently, from low and from high speed: a limit of the
//! power falls with the speed, one of the jerk acts at the beginning only
struct Parameters {
    /// largest acceleration that is commanded [m/s2], 0.15 to 4, neutral 4
    acap: f32,
}

fn accel_cap_command(own: Parameters, a_cmd: f32) -> f32 {
    return min(a_cmd, own.acap);
}
