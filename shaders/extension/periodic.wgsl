//! Adds As sin(2 pi f t) + Ac cos(2 pi f t) to the command.
//! in short: the command oscillates without a cause outside the car
//! equation: a = a + As sin + Ac cos (2 pi f t)
//! looks like: a line in the spectrum of the residuals
struct Parameters {
    /// amplitude of the sine [m/s2], -2 to 2, neutral 0
    As: f32,
    /// amplitude of the cosine [m/s2], -2 to 2, neutral 0
    Ac: f32,
    /// frequency [Hz], 0.005 to 1.5
    f: f32,
}

// sin(2 pi u) for u in 0..1 by a polynomial, which is the same on every device: error below 1e-6.
fn sine(u: f32) -> f32 {
    // To -1/4..1/4, where the series is short.
    let v = u - 0.5;
    let folded = select(select(v, 0.5 - v, v > 0.25), -0.5 - v, v < -0.25);
    let z = folded * folded;
    var s = 42.05869394489765 * z - 76.70585975306136;
    s = s * z + 81.60524927607504;
    s = s * z - 41.34170224039975;
    s = s * z + 6.283185307179586;
    return -(s * folded);
}

fn periodic_command(own: Parameters, w: World, a_cmd: f32) -> f32 {
    // A command holds for a step, so it is taken in the middle of the step.
    let turns = own.f * (w.t + 0.5 * w.dt);
    let u = turns - floor(turns);
    let quarter = u + 0.25;
    return a_cmd + own.As * sine(u) + own.Ac * sine(quarter - floor(quarter));
}
