//! Also reacts to the speed of the car before the preceding one: + k2 (v_l2 - v_l).
//! in short: the car before the one ahead is seen, too
//! equation: a_cmd = a_cmd + k2 (v_l2 - v_l)
//! family: anticipation
//! looks like: residuals in proportion to the speed difference of the two cars ahead
//! confounded with: leader_accel_ff
//! sign: positive
//! hides: phase
//! experiment: a car two ahead that brakes or accelerates while the one between keeps its speed
//! reference: Lenz, Wagner, Sollacher 1999, Eur. Phys. J. B 7, 331-335
struct Parameters {
    /// gain for the speed difference ahead [1/s], -1 to 1.5, neutral 0
    k2: f32,
}

fn multi_anticipation_command(own: Parameters, w: World, x: Perceived, a_cmd: f32) -> f32 {
    return a_cmd + own.k2 * (w.v_l2 - x.v_l);
}
