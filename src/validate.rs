//! Validation: calibrated parameters on trajectories they were not calibrated on (paper, Section 6).

use crate::evaluator::{Case, FailureKind, Outcome};
use crate::reference::{Reference, Trace};
use crate::symbols::Parameters;

/// Simulates calibrated parameters on each case, by the f64 reference; outcomes in the order of the cases.
#[must_use]
pub fn validate(cases: &[Case], parameters: &Parameters) -> Vec<Outcome> {
    let mut trace = Trace::default();
    cases.iter().map(|case| Reference::outcome(case, parameters, &mut trace)).collect()
}

/// True if a run ended in a collision, the paper's sign that calibrated parameters do not carry over: the spacing was not above 0.
#[must_use]
pub fn is_collision(outcome: &Outcome) -> bool {
    matches!(outcome.result, Err(failure) if failure.kind == FailureKind::Crash)
}
