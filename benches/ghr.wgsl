//! Gazis, Herman and Rothery's stimulus-response law.
struct Parameters {
    /// sensitivity [m^(l-m)/s^(1-m)], 0.01 to 50
    c: f32,
    /// exponent of the own speed [1], 0 to 2
    m: f32,
    /// exponent of the spacing [1], 0 to 3
    l: f32,
}

fn ghr_law(own: Parameters, x: Perceived) -> f32 {
    let gain = own.c * power(max(x.v_f, 0.1), own.m) / power(max(x.s, 0.5), own.l);
    return gain * (x.v_l - x.v_f);
}
