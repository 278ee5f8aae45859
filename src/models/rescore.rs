//! The reported number: in f64, by the reference, or by lanes if a user's law or extension has no second transcription.

use crate::catalog::Variant;
use crate::evaluator::{Case, EvaluateError, Evaluator, Job, Outcome, Population, Score, shares};
use crate::lanes::{Lanes, LanesPrecision};
use crate::reference::{Reference, Trace, knows};
use crate::score::GoodnessOfFit;
use crate::symbols::Parameters;

/// The evaluator of that number for a variant.
pub fn evaluator(variant: &Variant) -> &'static str {
    if knows(variant) { "reference" } else { "lanes" }
}

/// Simulates one candidate on one case and measures it; `trace` is overwritten.
pub fn outcome(case: &Case, parameters: &Parameters, trace: &mut Trace) -> Result<Outcome, EvaluateError> {
    if knows(&case.variant) {
        return Ok(Reference::outcome(case, parameters, trace));
    }
    let mut lanes = Lanes::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA, LanesPrecision::F64)?;
    let symbols = case.variant.parameters();
    let mut population = Population::new(&symbols);
    population.push(&symbols.iter().map(|symbol| parameters.get(*symbol)).collect::<Vec<_>>());
    let outcome = lanes.outcomes(&[Job { case: 0, population: &population }])?.remove(0);
    let first = case.first_sample(case.delay(parameters));
    // A run starts from the measured state.
    let history: [&[f64]; 3] = [&case.s, &case.v_f, &case.a_f];
    let states = lanes.trace(0, parameters, history, first, case.s.len())?;
    let end = first + states.len();
    let whole =
        |k: usize| history[k][..first].iter().copied().chain(states.iter().map(move |state| state[k])).collect();
    trace.s = whole(0);
    trace.v = whole(1);
    trace.a = whole(2);
    trace.x = (0..end).map(|i| case.x_l[i] - trace.s[i] - case.len_l).collect();
    Ok(outcome)
}

/// Simulates and measures one candidate on each case: calibrated parameters on drives they were not calibrated on (paper, Section 6).
/// The outcomes are in the order of the cases.
pub fn outcomes(cases: &[Case], parameters: &Parameters) -> Result<Vec<Outcome>, EvaluateError> {
    let mut trace = Trace::default();
    cases.iter().map(|case| outcome(case, parameters, &mut trace)).collect()
}

/// The score of one candidate over all cases. Panics without a case.
pub fn score(cases: &[Case], gof: &GoodnessOfFit, parameters: &Parameters) -> Result<Score, EvaluateError> {
    Ok(Score::of(outcomes(cases, parameters)?.into_iter().zip(shares(cases, gof)), gof, cases[0].convention.bounds))
}
