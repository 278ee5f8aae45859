// Values that an extension may read in addition to perception. At the sample from which a step starts: time in the file [s], time step
// [s], position on the road [m] (modulo the lap of a closed track), sine of the grade there, spacing [m], own speed [m/s] and
// acceleration [m/s2]. As perceived, so later with a perception delay: acceleration of the preceding vehicle [m/s2], smoothed
// over 1.1 s; speed of the car ahead of it [m/s] and the gap between those two [m]; the speed of the preceding vehicle [m/s]
// at the time of the extension's `loop: look back`, and at half of it.
struct World {
    t: f32,
    dt: f32,
    x_f: f32,
    sin_grade: f32,
    s: f32,
    v_f: f32,
    a_f: f32,
    a_l: f32,
    v_l2: f32,
    s_l2: f32,
    v_l_then: f32,
    v_l_half: f32,
}

// Of these, the look-ups of the time loop.
struct Given {
    t: f32,
    x_f: f32,
    a_l: f32,
    v_l2: f32,
    s_l2: f32,
    v_l_then: f32,
    v_l_half: f32,
}
