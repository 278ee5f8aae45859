//! The own speed is seen 1 + cv times as large: a tyre of another size.
//! in short: the own speed is measured too high or too low
//! equation: v = (1 + cv) v
//! family: absorbed
//! looks like: nothing that a calibration leaves
//! confounded with: t_h
//! experiment: an independent measurement of gap and speeds (satellite positions of both cars, a tape at standstill): an error of a sensor
//! shows there, and only there
struct Parameters {
    /// relative error of the perceived own speed [-], -0.15 to 0.15, neutral 0
    cv: f32,
}

fn speed_scale_perception(own: Parameters, x: Perceived) -> Perceived {
    return Perceived(x.s, x.v_f * (1.0 + own.cv), x.v_l);
}
