//! The command is multiplied by 1 + m: another mass, or another gain of the drive.
//! in short: the car is lighter or heavier than its controller thinks
//! equation: a_cmd = (1 + m) a_cmd
//! family: absorbed
//! looks like: nothing that a calibration leaves, unless a limit or the grade acts too
//! confounded with: a_max, k_s, k_v
//! experiment: an independent measurement of gap and speeds (satellite positions of both cars, a tape at standstill): an error of a sensor
//! shows there, and only there
struct Parameters {
    /// relative change of the gain [-], -0.5 to 0.6, neutral 0
    m: f32,
}

fn gain_mass_command(own: Parameters, a_cmd: f32) -> f32 {
    return a_cmd * (1.0 + own.m);
}
