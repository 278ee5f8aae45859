//! Inputs of the parts.

/// Perceived signals, delayed by τ_p.
#[derive(Debug, Clone, Copy)]
pub struct Perceived {
    /// Spacing s(t - τ_p) \[m\].
    pub s: f64,
    /// Ego speed v_f(t - τ_p) \[m/s\].
    pub v_f: f64,
    /// Speed of the preceding vehicle v_l(t - τ_p) \[m/s\].
    pub v_l: f64,
}

impl Perceived {
    /// Δv = v_l - v_f \[m/s\], positive when the gap opens.
    pub fn dv(&self) -> f64 {
        self.v_l - self.v_f
    }
}

/// The ego vehicle at the current sample.
#[derive(Debug, Clone, Copy)]
pub struct Ego {
    /// Speed \[m/s\].
    pub v_f: f64,
    /// Acceleration \[m/s²\].
    pub a_f: f64,
    /// Unladen mass \[kg\].
    pub m_0: f64,
    /// Equivalent inertial mass factor.
    pub phi_f: f64,
    /// Time step \[s\].
    pub dt: f64,
}

/// Values looked up for the current position and speed.
#[derive(Debug, Clone, Copy)]
pub struct Road {
    /// Sine of the grade under the ego vehicle.
    pub sin_grade: f64,
    /// Deceleration potential \[m/s²\].
    pub a_dp: f64,
    /// Acceleration potential \[m/s²\].
    pub a_ap: f64,
}
