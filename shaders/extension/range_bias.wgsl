//! The spacing is seen b larger.
//! family: absorbed
//! looks like: nothing that a calibration leaves
//! confounded with: d_0
struct Parameters {
    /// error of the seen spacing [m], -5 to 5, neutral 0
    b: f32,
}

fn range_bias_perception(own: Parameters, x: Perceived) -> Perceived {
    return Perceived(x.s + own.b, x.v_f, x.v_l);
}
