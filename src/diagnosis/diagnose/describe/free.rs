//! Free simulations of a drive by the lanes in f64, extensions included.

use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::diagnose::drive::Drive;
use crate::diagnose::outcome::Adopted;
use crate::diagnose::question::DiagnoseError;
use crate::evaluator::{Case, Evaluator};
use crate::lanes::{Lanes, LanesPrecision};
use crate::score::GoodnessOfFit;
use crate::symbols::Parameters;
use serde::{Deserialize, Serialize};

/// The parameters on a drive: events of other recordings do nothing.
fn happening(parameters: &Parameters, adopted: &[Adopted], drive: &Drive) -> Parameters {
    let mut here = *parameters;
    let recording = drive.recording();
    let elsewhere = adopted.iter().filter(|cause| cause.recording.as_ref().is_some_and(|own| *own != recording));
    for symbol in elsewhere.flat_map(|cause| &cause.extension.parameters) {
        if let Some(neutral) = symbol.neutral() {
            here.set(*symbol, neutral);
        }
    }
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
) -> Result<Vec<Free>, DiagnoseError> {
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

/// NRMSE(s,v,a) of free simulations together; `None` if one of them ends early.
#[must_use]
pub fn nrmse_of(runs: &[Free]) -> Option<f64> {
    let complete = !runs.is_empty() && runs.iter().all(|run| run.complete);
    let signal = |k: usize| {
        let samples = runs.iter().flat_map(|run| run.errors[k].iter().zip(&run.simulated[k]));
        let squares = samples.map(|(error, simulated)| [error.powi(2), (simulated - error).powi(2)]);
        let [errors, measured] = squares.fold([0.0; 2], |[a, b], [error, measured]| [a + error, b + measured]);
        (errors / measured.max(f64::MIN_POSITIVE)).sqrt()
    };
    complete.then(|| (0..3).map(signal).sum())
}
