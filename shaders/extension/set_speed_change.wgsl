//! The set speed is vlim from t1 on, for dur: the command is at most 0.5 (vlim - v).
//! in short: a lower set speed was chosen for a while
//! equation: a_cmd <= (vlim - v) / 2 from t1 for dur
//! looks like: one stretch in which the car stays behind although the road ahead is free
//! confounded with: accel_cap, power_cap
//! scale: ratio
//! experiment: the same drive again without touching the settings: a change of settings does not recur
struct Parameters {
    /// set speed meanwhile [m/s], 1 to 60, neutral 60
    vlim: f32,
    /// when it begins, time in the file [s], 0 to 100000
    t1: f32,
    /// how long it lasts [s], 1 to 100000, length of time
    dur: f32,
}

fn set_speed_change_command(own: Parameters, w: World, a_cmd: f32) -> f32 {
    // In a step in which the stretch begins or ends, each of the two commands acts for its share of the time.
    let since = w.t - own.t1;
    let begun = min(since + w.dt, w.dt);
    let left = min(own.dur - since, w.dt);
    let part = max(begun + left - w.dt, 0.0) / w.dt;
    // Uses the speed in the middle of the step, which this command itself changes.
    let held = min(a_cmd, 0.5 * (own.vlim - w.v_f) / (1.0 + 0.25 * w.dt));
    return a_cmd + part * (held - a_cmd);
}
