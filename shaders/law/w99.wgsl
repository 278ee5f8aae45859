//! Wiedemann 99 as in SUMO's W99, each random number at its mean: 0 in the threshold, 0.5 m/s2 in the free acceleration.
//! CC0 is d_0, which is all of the shortest spacing behind a vehicle that stands. As SUMO does afterwards: at most cc8, the present own
//! speed at most v_0 after the step, and, applied last, at least -9 m/s2. Own acceleration undelayed, speeds and spacing as perceived.
//! reference: Wiedemann, Reiter (1992); SUMO 1.28, W99
struct Parameters {
    v_0: f32,
    d_0: f32,
    /// time headway of the shortest spacing [s], 0.1 to 3
    cc1: f32,
    /// variation of the spacing in following [m], 0 to 20
    cc2: f32,
    /// additional distance of the begin of braking per speed difference [s], -30 to 0
    cc3: f32,
    /// negative speed difference in following [m/s], -3 to 0
    cc4: f32,
    /// positive speed difference in following [m/s], 0 to 3
    cc5: f32,
    /// growth of both with the squared spacing, in 1/10000 [1/(m s)], 0 to 30
    cc6: f32,
    /// acceleration in following, either way [m/s2], 0 to 2
    cc7: f32,
    /// largest acceleration, and that of a standing car [m/s2], 0.1 to 6
    cc8: f32,
    /// growth of the free acceleration with the speed, up to 80 km/h; above 0 cc8 alone limits [1/s], -0.2 to 0
    cc9: f32,
}

// SUMO's emergencyDecel of a passenger car [m/s2].
const EMERGENCY: f32 = 9.0;

// Closer than the shortest spacing: braking for the speed difference, by at least cc7.
fn too_close(own: Parameters, w: World, x: Perceived, dv: f32, opening: f32) -> f32 {
    // The first of the two applies only for spacings above d_0.
    let outside = w.a_l + dv * dv / min(own.d_0 - x.s, -0.000001);
    let inside = w.a_l + 0.5 * (dv - opening);
    let wanted = select(0.0, min(select(inside, outside, x.s > own.d_0), 0.0), dv < 0.0);
    let bounded = max(wanted, 0.5 * sqrt(max(x.v_f, 0.0)) - 10.0);
    let braking = select(bounded, -own.cc7, wanted > -own.cc7);
    // No effect behind a vehicle that stands.
    return select(0.0, braking, x.v_l > 0.0);
}

fn w99_law(own: Parameters, w: World, x: Perceived, v_f: f32) -> f32 {
    let dv = x.v_l - x.v_f;
    // Spacings: the shortest (SDXC), the longest in following (SDXO), and where braking for a slower vehicle begins (SDXV).
    let slower = select(x.v_l, x.v_f, dv >= 0.0 || w.a_l < 1.0);
    let sdxc = opaque(own.d_0 + select(0.0, own.cc1 * max(slower, 0.0), x.v_l > 0.0));
    let sdxo = opaque(sdxc + own.cc2);
    let sdxv = opaque(sdxo + own.cc3 * opaque(dv - own.cc4));
    // Speed differences: perceived from this distance (SDV), closing (SDVC) and opening (SDVO).
    let sdv = own.cc6 * x.s * x.s / 10000.0;
    let sdvc = select(0.0, own.cc4 - sdv, x.v_f > 0.0);
    let sdvo = sdv + select(0.0, own.cc5, x.v_l > own.cc5);
    // Closing in: braking to reach the shortest spacing, which is smaller than the present one here.
    let closing = 0.5 * dv * dv / min(opaque(sdxc - x.s) - 0.1, -0.1);
    // Following: at least cc7, with the sign of the present acceleration.
    let following = select(max(w.a_f, own.cc7), min(w.a_f, -own.cc7), w.a_f <= 0.0);
    // Free: the largest acceleration, reduced near the longest spacing.
    let most = opaque(own.cc8 + own.cc9 * (min(3.6 * x.v_f, 80.0) / 3.6)) + 0.5;
    let near = min(dv * dv / max(opaque(sdxo - x.s), 0.000001), most);
    let free = select(0.0, select(most, near, x.s < sdxo), x.s > sdxc);
    // The first that applies.
    let follows = select(free, following, dv < sdvo && x.s < sdxo);
    let closes = select(follows, closing, dv < sdvc && x.s < sdxv);
    let a = select(closes, too_close(own, w, x, dv, sdvo), dv < sdvo && x.s <= sdxc);
    return max(min(min(a, own.cc8), (own.v_0 - v_f) / w.dt), -EMERGENCY);
}

// There is no state of rest: below the end of following the car brakes by cc7, above it the car accelerates. From v_0 on, that of v_0.
fn w99_equilibrium(own: Parameters, v: f32) -> f32 {
    return own.d_0 + own.cc1 * min(v, own.v_0) + own.cc2;
}
