//! The command is at most P / v.
//! in short: the engine's power ends
//! equation: a_cmd <= P / v
//! looks like: too little acceleration at high demand, growing with the speed
//! confounded with: accel_cap
//! search: limit
//! scale: ratio
//! experiment: a leader that drives off fast and brakes hard, both abruptly and gently, from low and from high speed: a limit of the
//! power falls with the speed, one of the jerk acts at the beginning only
//! reference: Makridis, Fontaras, Ciuffo, Mattas 2019, Transp. Res. Rec. 2673(4), 762-777 (MFC)
struct Parameters {
    /// power per mass [W/kg], 2 to 60, neutral 60
    P: f32,
}

fn power_cap_command(own: Parameters, w: World, a_cmd: f32) -> f32 {
    return min(a_cmd, own.P / max(w.v_f, 0.1));
}
