//! Free simulations of a drive, by the lanes in f64: the text itself, extensions included.

use crate::evaluator::{Case, EvaluateError, Evaluator};
use crate::lanes::{Lanes, LanesPrecision};
use crate::score::GoodnessOfFit;
use crate::symbols::Parameters;

/// A free simulation; the vectors begin at sample `first`.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// First simulated sample.
    pub first: usize,
    /// Simulated spacing \[m\], speed \[m/s\] and acceleration \[m/s²\].
    pub simulated: [Vec<f64>; 3],
    /// Simulated minus measured.
    pub errors: [Vec<f64>; 3],
    /// True if it came to the end.
    pub complete: bool,
}

/// Simulates one candidate on every case.
///
/// # Errors
/// When the text cannot run.
pub fn free(cases: &[Case], parameters: &Parameters) -> Result<Vec<Free>, EvaluateError> {
    let lanes = Lanes::new(cases.to_vec(), GoodnessOfFit::NRMSE_SVA, LanesPrecision::F64)?;
    let one = |(i, case): (usize, &Case)| {
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
