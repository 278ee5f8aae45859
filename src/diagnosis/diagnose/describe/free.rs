//! Free simulations of a drive by the lanes in f64, extensions included.

use super::event_mask::absent;
use crate::calibrate::{CalibrateError, Overrides};
use crate::catalog::Variant;
use crate::diagnose::drive::Drive;
use crate::diagnose::outcome::Adopted;
use crate::diagnose::question::DiagnoseError;
use crate::evaluator::{Case, CaseError, EvaluateError, Evaluator};
use crate::lanes::{Lanes, LanesPrecision};
use crate::score::GoodnessOfFit;
use crate::symbols::Parameters;
use serde::{Deserialize, Serialize};

/// A gain that cannot be measured.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum GainError {
    #[error(transparent)]
    Case(#[from] CaseError),
    #[error(transparent)]
    Model(#[from] DiagnoseError),
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
}

/// The parameters on a drive: events of other recordings do nothing.
fn happening(parameters: &Parameters, adopted: &[Adopted], drive: &Drive) -> Parameters {
    let mut here = *parameters;
    absent(adopted, drive).into_iter().for_each(|(symbol, neutral)| here.set(symbol, neutral));
    here
}

/// A free simulation; the vectors begin at sample `first`.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// First simulated sample.
    pub first: usize,
    /// Simulated spacing \[m\], speed \[m/s\] and acceleration \[m/s²\].
    pub simulated: [Vec<f64>; 3],
    /// Simulated minus measured.
    pub errors: [Vec<f64>; 3],
    /// True if it reaches the end of the drive.
    pub complete: bool,
}

/// A free simulation of the base model that does not reach the end of its drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BrokenOffEntry {
    /// The drive, as in `drives`.
    pub label: String,
    /// When it ends \[s\], in the file's own time.
    pub time_s: f64,
    /// True if the car collides with the car ahead; otherwise the simulation gives a value that is not finite.
    pub crash: bool,
}

impl BrokenOffEntry {
    /// The message.
    #[must_use]
    pub fn told(&self) -> String {
        let BrokenOffEntry { label, time_s, crash } = self;
        let what = if *crash { "collides with the car ahead" } else { "ends early" };
        format!("{label}: the base model {what} at t = {time_s:.1} s (all errors end there)")
    }
}

/// Simulates a model on every drive; `bounds` give the longest delay. Events of one recording do not happen in the others. For two variants
/// to be compared, name the other one as `beside`; both then start at the same samples.
///
/// # Errors When a drive lacks data of the variant, or the text cannot run.
pub fn free<'a>(
    drives: impl IntoIterator<Item = &'a Drive>,
    [variant, beside]: [Variant; 2],
    parameters: &Parameters,
    adopted: &[Adopted],
    bounds: &Overrides,
) -> Result<Vec<Free>, GainError> {
    let drives: Vec<&Drive> = drives.into_iter().collect();
    let case = |drive: &&Drive| drive.case_beside(variant, beside, bounds);
    let cases = drives.iter().map(case).collect::<Result<Vec<_>, _>>()?;
    let lanes = Lanes::new(cases, GoodnessOfFit::NRMSE_SVA, LanesPrecision::F64)?;
    let one = |(i, case): (usize, &Case)| {
        let parameters = &happening(parameters, adopted, drives[i]);
        let first = case.first_sample(parameters.tau_p);
        let history = [&case.s[..first], &case.v_f[..first], &case.a_f[..first]];
        let states = lanes.trace(i, parameters, history, first, case.s.len())?;
        let signal = |k: usize| states.iter().map(|state| state[k]).collect::<Vec<f64>>();
        let simulated = [0, 1, 2].map(signal);
        let measured: [&[f64]; 3] = [&case.s, &case.v_f, &case.a_f];
        let error = |k: usize| simulated[k].iter().zip(&measured[k][first..]).map(|(a, b)| a - b).collect();
        let complete = states.len() == case.s.len() - first && states.iter().flatten().all(|x| x.is_finite());
        Ok(Free { first, errors: [0, 1, 2].map(error), complete, simulated })
    };
    lanes.cases().iter().enumerate().map(one).collect()
}
