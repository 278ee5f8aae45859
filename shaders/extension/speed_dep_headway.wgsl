//! The desired spacing grows by q v^2.
//! in short: the desired gap grows faster with speed
//! equation: s_des = s_des + q v^2
//! family: drag_or_headway
//! looks like: spacing errors that grow with the square of the speed, in steady following
//! confounded with: aero_drag, t_h, d_0
//! experiment: driving without a car ahead at several set speeds: drag lowers the speed that is kept, a headway does not act there
struct Parameters {
    /// growth of the desired spacing with the squared speed [s2/m], -0.03 to 0.05, neutral 0
    q: f32,
}

fn speed_dep_headway_policy(p: Params, own: Parameters, x: Perceived) -> Params {
    var changed = p;
    changed.d_0 = p.d_0 + own.q * x.v_f * x.v_f;
    return changed;
}
