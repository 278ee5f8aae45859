//! The spacing is seen 1 + cs times as large.
//! in short: the gap is measured too large or too small
//! equation: s = (1 + cs) s
//! family: absorbed
//! looks like: nothing that a calibration leaves
//! confounded with: d_0, t_h, k_s
//! experiment: an independent measurement of gap and speeds (satellite positions of both cars, a tape at standstill): an error of a sensor
//! shows there, and only there
struct Parameters {
    /// relative error of the seen spacing [-], -0.2 to 0.2, neutral 0
    cs: f32,
}

fn range_scale_perception(own: Parameters, x: Perceived) -> Perceived {
    return Perceived(x.s * (1.0 + own.cs), x.v_f, x.v_l);
}
