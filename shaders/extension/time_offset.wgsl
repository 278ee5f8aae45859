//! The preceding vehicle is seen as it was `to` ago, oneself as now: the clocks of two records differ, or a sensor is late.
//! in short: the car ahead is seen late, oneself in time
//! equation: law(leader at t - to, ego at t)
//! family: phase
//! looks like: residuals in proportion to the acceleration of the preceding vehicle
//! confounded with: perception_delay, sensor_lowpass, leader_accel_ff
//! sign: positive
//! experiment: a leader that brakes and accelerates at once and hard, under sensors with little noise: a delay shifts the response, a lag or
//! filter rounds it
//! loop: look back by to
struct Parameters {
    /// how long ago the preceding vehicle is seen [s], -1 to 1, neutral 0
    to: f32,
}

fn time_offset_perception(own: Parameters, w: World, x: Perceived) -> Perceived {
    // Simpson's rule for the displacement of the preceding vehicle in between. Opaque, because Mesa would reorder the terms.
    let sum = opaque(opaque(x.v_l + w.v_l_then) + 4.0 * w.v_l_half);
    let way = own.to / 6.0 * sum;
    return Perceived(x.s - way, x.v_f, w.v_l_then);
}
