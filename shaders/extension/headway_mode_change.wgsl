//! The time headway is multiplied by 1 + r from t0 on, over 4 s.
//! in short: another gap setting was chosen
//! equation: t_h = (1 + r) t_h from t0 on
//! looks like: spacing errors of one sign from a certain time on
//! confounded with: integral_action
//! experiment: the same drive again without touching the settings: a change of settings does not recur
struct Parameters {
    /// relative change of the time headway [-], -0.6 to 1.5, neutral 0
    r: f32,
    /// when it begins, time in the file [s], 0 to 100000
    t0: f32,
}

// Duration of the change [s].
const RAMP: f32 = 4.0;

fn headway_mode_change_policy(p: Params, own: Parameters, w: World) -> Params {
    var changed = p;
    changed.t_h = p.t_h * (1.0 + own.r * clamp((w.t - own.t0) * (1.0 / RAMP), 0.0, 1.0));
    return changed;
}
