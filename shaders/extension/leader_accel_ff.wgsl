//! Adds ka times the acceleration of the preceding vehicle, smoothed over 1.1 s.
//! in short: the acceleration of the car ahead is used
//! equation: a_cmd = a_cmd + ka a_l
//! family: anticipation
//! looks like: residuals in proportion to the acceleration of the preceding vehicle
//! confounded with: time_offset, multi_anticipation
//! sign: positive
//! hides: phase
//! experiment: a leader that accelerates at once from a constant speed: anticipation answers before speed and gap have changed
struct Parameters {
    /// share of the acceleration ahead that is passed on [-], -0.6 to 1.3, neutral 0
    ka: f32,
}

fn leader_accel_ff_command(own: Parameters, w: World, a_cmd: f32) -> f32 {
    return a_cmd + own.ka * w.a_l;
}
