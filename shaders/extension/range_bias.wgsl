//! The spacing is seen b larger.
//! in short: the gap is measured too large or too small by a constant
//! equation: s = s + b
//! family: absorbed
//! looks like: nothing that a calibration leaves
//! confounded with: d_0
//! experiment: an independent measurement of gap and speeds (satellite positions of both cars, a tape at standstill): an error of a sensor
//! shows there, and only there
struct Parameters {
    /// error of the seen spacing [m], -5 to 5, neutral 0
    b: f32,
}

fn range_bias_perception(own: Parameters, x: Perceived) -> Perceived {
    return Perceived(x.s + own.b, x.v_f, x.v_l);
}
