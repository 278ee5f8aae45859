//! Spacing errors below w are not seen, larger ones are w smaller.
//! in short: small errors of the gap are not corrected
//! equation: ds = ds shrunk by w
//! looks like: spacing that wanders freely around the desired one
//! confounded with: integral_action, decel_cap
struct Parameters {
    /// half width of the zone [m], 0 to 8, neutral 0
    w: f32,
}

fn dead_zone_perception(p: Params, own: Parameters, x: Perceived) -> Perceived {
    let error = x.s - equilibrium_spacing(p, x.v_f);
    return Perceived(x.s - clamp(error, -own.w, own.w), x.v_f, x.v_l);
}
