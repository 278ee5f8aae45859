//! The command is at least -bcap.
//! looks like: too little braking where much is wanted
//! confounded with: dead_zone, jerk_limit
struct Parameters {
    /// largest deceleration that is commanded [m/s2], 0.3 to 6, neutral 6
    bcap: f32,
}

fn decel_cap_command(own: Parameters, a_cmd: f32) -> f32 {
    return max(a_cmd, -own.bcap);
}
