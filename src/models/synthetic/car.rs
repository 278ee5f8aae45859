//! Properties of each car.

use super::effect::Effect;
use serde::{Deserialize, Serialize};

/// The platoon leader: cruise control that follows the set speed of the scenario.
///
/// It compensates the level-road load but not the grade, so its speed wavers with the hills by
/// `g * sin_grade / k`, as the platoon leader of the AstaZero drives does (about 0.35 m/s on 3 %).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Lead {
    /// Name written into the file.
    pub name: String,
    /// Length of the car \[m\].
    #[serde(rename = "length_m")]
    pub length: f64,
    /// Gain on set speed minus speed \[1/s\].
    pub k: f64,
    /// Actuation lag \[s\].
    pub tau_a: f64,
}

/// A follower: controller, perception delay, actuation lag, road load and bounds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CarTruth {
    /// Name written into the file.
    pub name: String,
    /// Length of the car \[m\].
    #[serde(rename = "length_m")]
    pub length: f64,
    /// Bumper-to-bumper gap to the car ahead at the start, at standstill \[m\].
    #[serde(rename = "initial_gap_m")]
    pub initial_gap: f64,
    /// The controller: from perceived signals to an acceleration command.
    pub controller: Controller,
    /// Perception delay \[s\]: 0, or at least the fine step.
    pub tau_p: f64,
    /// Actuation lag \[s\]; 0 for an immediate response.
    pub tau_a: f64,
    /// Road load and grade that the command does not compensate (Eq. 11); `None` as in Eqs. 9 and 10.
    pub load: Option<RoadLoad>,
    /// Lower bound of the acceleration \[m/s²\] (Eq. 13), negative.
    pub a_lb: f64,
    /// Upper bound of the acceleration \[m/s²\] (Eq. 13).
    pub a_ub: f64,
    /// Effects that the paper's models lack.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<Effect>,
    /// Random accelerations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gusts: Option<Gusts>,
}

/// Random accelerations, as from wind and road: first-order autoregression.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gusts {
    /// Standard deviation \[m/s²\].
    pub sigma_mps2: f64,
    /// Time constant \[s\].
    pub time_constant_s: f64,
}

/// The acceleration command of a follower, with the paper's symbols, in SI units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Controller {
    /// Intelligent Driver Model, Eqs. 2 and 3.
    Idm { v_0: f64, t_h: f64, d_0: f64, a_max: f64, a_min: f64, delta: f64 },
    /// Gipps' model, Eqs. 4 and 5.
    Gipps { v_0: f64, t_h: f64, d_0: f64, a_max: f64, a_min: f64, a_hat_min: f64, theta: f64 },
    /// Linear law with constant time headway, Eqs. 6 and 7.
    Linear { v_0: f64, t_h: f64, d_0: f64, k_s: f64, k_v: f64, k_0: f64 },
    /// Linear law with the desired spacing of the IDM, Eqs. 3 and 6.
    LinearIdm { v_0: f64, t_h: f64, d_0: f64, k_s: f64, k_v: f64, k_0: f64, a_max: f64, a_min: f64 },
    /// Linear law with the spacing of Gipps' model at equilibrium, Eqs. 6 and 8.
    LinearGipps { v_0: f64, t_h: f64, d_0: f64, k_s: f64, k_v: f64, k_0: f64, theta: f64, a_min: f64, a_hat_min: f64 },
}

/// Mass and resistances of Eq. 11, in SI units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoadLoad {
    /// Operating mass \[kg\].
    pub m_f: f64,
    /// Equivalent inertial mass factor.
    pub phi_f: f64,
    /// Constant resistance \[N\].
    pub f_0: f64,
    /// Linear resistance \[kg/s\].
    pub f_1: f64,
    /// Quadratic resistance \[kg/m\].
    pub f_2: f64,
}

/// Standard gravity \[m/s²\].
pub(super) const GRAVITY: f64 = 9.80665;

impl RoadLoad {
    /// Eq. 11: acceleration that remains of a tractive acceleration \[m/s²\].
    pub(super) fn net(&self, a_t: f64, v: f64, sin_grade: f64) -> f64 {
        let cos_grade = (1.0 - sin_grade * sin_grade).sqrt();
        let resistance = self.f_0 * cos_grade + (self.f_1 + self.f_2 * v) * v + self.m_f * GRAVITY * sin_grade;
        (a_t - resistance / self.m_f) / self.phi_f
    }
}

/// Position at the start, at rest behind a car whose rear bumper is at `rear` \[m\].
pub(super) fn behind(car: &CarTruth, rear: f64) -> f64 {
    rear - car.initial_gap
}
