// Inputs of the parts. The same names, in the same units, as src/models/reference/types.rs.

// Perceived signals, delayed by tau_p: spacing [m], ego speed [m/s], speed of the preceding vehicle [m/s].
struct Perceived {
    s: f32,
    v_f: f32,
    v_l: f32,
}

// Output of a controller: a_cmd [m/s2], and whether its own equation has a solution (Gipps' radicand).
struct Command {
    a_cmd: f32,
    feasible: bool,
}

// The ego vehicle at the current sample: speed [m/s], acceleration [m/s2], unladen mass [kg], equivalent inertial mass
// factor [-], time step [s].
struct Ego {
    v_f: f32,
    a_f: f32,
    m_0: f32,
    phi_f: f32,
    dt: f32,
}

// Looked up for the current position and speed: sine of the grade, deceleration and acceleration potential [m/s2].
struct Road {
    sin_grade: f32,
    a_dp: f32,
    a_ap: f32,
}
