//! The command is at least -bcap.
//! in short: no stronger braking is asked for
//! equation: a_cmd >= -bcap
//! looks like: too little braking where much is wanted
//! confounded with: dead_zone, jerk_limit
//! search: limit
//! scale: ratio
//! experiment: a leader that drives off fast and brakes hard, both abruptly and gently, from low and from high speed: a limit of the
//! power falls with the speed, one of the jerk acts at the beginning only
struct Parameters {
    /// largest deceleration that is commanded [m/s2], 0.3 to 6, neutral 6
    bcap: f32,
}

fn decel_cap_command(own: Parameters, a_cmd: f32) -> f32 {
    return max(a_cmd, -own.bcap);
}
