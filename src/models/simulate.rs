//! Running calibrated parameters again: on another trajectory, or behind a simulated car.

use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::{Case, CaseError};
use crate::reference::Trace;
use crate::symbols::{Parameters, Symbol};
use crate::text::option::{FROM, TO};
use crate::trajectory::Trajectory;
use crate::vehicle::Vehicle;
use std::sync::Arc;

/// Columns of `simulation.csv`: time, the speed of the preceding vehicle, the measured follower, the simulated one.
pub const SIMULATION_COLUMNS: [&str; 9] = [
    "time_s",
    "lead_speed_mps",
    "spacing_m",
    "speed_mps",
    "accel_mps2",
    "sim_position_m",
    "sim_spacing_m",
    "sim_speed_mps",
    "sim_accel_mps2",
];

/// A variant with calibrated parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedVariant {
    pub variant: Variant,
    /// The convention it was calibrated under.
    pub convention: Convention,
    pub parameters: Parameters,
    /// Upper bound of the perception delay \[s\], which fixes the scored window.
    pub tau_p_upper: f64,
    /// Upper bound of the delay of an extension \[s\], if known; likewise.
    pub extension_delay_upper: Option<f64>,
    /// Time at the start \[s\] in which the car was the measured one, if that was requested.
    pub history_s: Option<f64>,
}

impl CalibratedVariant {
    /// A trajectory for its runs.
    pub fn case(&self, trajectory: &Trajectory, vehicle: Option<&Vehicle>) -> Result<Case, CaseError> {
        let delays = (self.tau_p_upper, self.extension_delay_upper);
        Case::within(trajectory, self.variant, vehicle, self.convention, delays)?.with_history(self.history_s)
    }
}

/// A simulated car that leads the next one.
#[derive(Debug, Clone, Copy)]
pub struct Ahead<'a> {
    pub case: &'a Case,
    /// Its time axis \[s\].
    pub t: &'a [f64],
    /// Its simulated states.
    pub trace: &'a Trace,
}

/// Cars that do not share a time axis.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "{behind} runs from {from} to {to} s with {samples} samples, the simulated part of {ahead}, the car ahead, from \
     {ahead_from} to {ahead_to} s with {ahead_samples}: cut both to one gap-free window with {FROM} and {TO}"
)]
pub struct AxisError {
    behind: String,
    from: f64,
    to: f64,
    samples: usize,
    ahead: String,
    ahead_from: f64,
    ahead_to: f64,
    ahead_samples: usize,
}

/// The case of a follower, measured at times `t`, behind a simulated preceding vehicle. The car two ahead is the measured or simulated one
/// that the preceding vehicle drove behind.
///
/// Positions of two pairs have different origins; the measured start of the shared car gives the difference. Fails unless the two share every sample.
pub fn follow(case: &Case, t: &[f64], ahead: Ahead) -> Result<Case, AxisError> {
    if ahead.trace.x.len() != t.len() || ahead.t != t {
        let last = |t: &[f64]| t.last().copied().unwrap_or(f64::NAN);
        return Err(AxisError {
            behind: case.label.to_string(),
            from: t[0],
            to: last(t),
            samples: t.len(),
            ahead: ahead.case.label.to_string(),
            ahead_from: ahead.t[0],
            ahead_to: last(ahead.t),
            ahead_samples: ahead.trace.x.len(),
        });
    }
    let shift = case.x_l[0] - ahead.case.x_f[0];
    Ok(Case {
        x_l: ahead.trace.x.iter().map(|x| x + shift).collect(),
        v_l: ahead.trace.v.as_slice().into(),
        a_l: None,
        v_l2: Some(Arc::clone(&ahead.case.v_l)),
        s_l2: Some(ahead.trace.s.as_slice().into()),
        ..case.clone()
    })
}
/// A desired speed beyond this multiple of the highest driven speed is probably a mistake.
const FAR: f64 = 2.0;
/// No road vehicle has a higher desired speed \[m/s\]: 252 km/h, the upper bound of the set human.
const DESIRED: f64 = 70.0;

/// True if a desired speed is far above the highest one that was driven \[m/s\].
pub fn far_above(v_0: f64, fastest: f64) -> bool {
    v_0 > FAR * fastest
}

/// The same in words.
pub fn far_above_in_words(v_0: f64, fastest: f64) -> String {
    let unit = if v_0 > DESIRED { ": is it in km/h? m/s are expected" } else { ", so it changes little" };
    format!("v_0 = {v_0} m/s is far above the largest speed of the follower, {fastest:.1} m/s{unit}")
}

/// The warning about a case with these parameters, if its desired speed is far above the highest driven one.
pub fn far_above_in(case: &Case, parameters: &Parameters) -> Option<String> {
    let (v_0, fastest) = (parameters.get(Symbol::v_0), case.v_f.iter().copied().fold(0.0, f64::max));
    let is_far = case.variant.parameters().contains(&Symbol::v_0) && far_above(v_0, fastest);
    is_far.then(|| format!("{}: {}", case.label, far_above_in_words(v_0, fastest)))
}
