//! The command comes in steps of qz.
//! looks like: small sawtooth residuals wherever the command changes slowly
struct Parameters {
    /// size of a step [m/s2], 0 to 1.2, neutral 0
    qz: f32,
}

fn quantised_accel_command(own: Parameters, a_cmd: f32) -> f32 {
    let step = max(own.qz, 0.000001);
    let rounded = floor(a_cmd / step + 0.5) * step;
    return select(a_cmd, rounded, own.qz > 0.000001);
}
