//! Validation: calibrated parameters on trajectories they were not calibrated on (paper, Section 6).

use crate::evaluator::{Case, EvaluateError, FailureKind, Outcome};
use crate::reference::Trace;
use crate::rescore;
use crate::symbols::Parameters;

/// Simulates calibrated parameters on each case, in f64; outcomes in the order of the cases.
///
/// # Errors
/// As [`rescore::outcome`].
pub fn validate(cases: &[Case], parameters: &Parameters) -> Result<Vec<Outcome>, EvaluateError> {
    let mut trace = Trace::default();
    cases.iter().map(|case| rescore::outcome(case, parameters, &mut trace)).collect()
}

/// True if a run ended in a collision, the paper's sign that calibrated parameters do not carry over: the spacing was not above 0.
#[must_use]
pub fn is_collision(outcome: &Outcome) -> bool {
    matches!(outcome.result, Err(failure) if failure.kind == FailureKind::Crash)
}
