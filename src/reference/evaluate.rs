//! The reference as an evaluator: one candidate after the other, spread over threads.

use super::simulate::{Run, Trace, simulate};
use crate::catalog::Variant;
use crate::convention::Denominators;
use crate::evaluator::{Case, EvaluateError, Evaluator, Outcome, Population, Score};
use crate::score::{GoodnessOfFit, Measures, SignalMeasures};
use crate::symbols::Parameters;
use rayon::prelude::*;

/// The f64 reference evaluator of one variant over one or several cases.
#[derive(Debug, Clone)]
pub struct Reference {
    variant: Variant,
    cases: Vec<Case>,
    gof: GoodnessOfFit,
}

impl Reference {
    /// An evaluator of these cases; the score is the mean of `gof` over them.
    ///
    /// # Panics
    /// Without cases, or if they were prepared for different variants.
    #[must_use]
    pub fn new(cases: Vec<Case>, gof: GoodnessOfFit) -> Reference {
        let variant = cases.first().expect("at least one case").variant;
        assert!(cases.iter().all(|c| c.variant == variant), "cases of one variant");
        Reference { variant, cases, gof }
    }

    /// The cases.
    #[must_use]
    pub fn cases(&self) -> &[Case] {
        &self.cases
    }

    /// Simulates one candidate on one case and measures it.
    pub fn outcome(case: &Case, parameters: &Parameters, trace: &mut Trace) -> Outcome {
        let run = simulate(case, parameters, trace);
        let result = match run.failure {
            Some(failure) => Err(failure),
            None => {
                let floored = case.convention.denominators == Denominators::Floored;
                let compare = |simulated: &[f64], measured: &[f64], floored| {
                    SignalMeasures::compare(&simulated[run.first..], &measured[run.first..], floored)
                };
                Ok(Measures([
                    compare(&trace.s, &case.s, false),
                    compare(&trace.v, &case.v_f, floored),
                    compare(&trace.a, &case.a_f, false),
                ]))
            }
        };
        let Run { delay_steps, n_cut_acc, n_cut_dec, .. } = run;
        Outcome { result, delay_steps, n_cut_acc, n_cut_dec }
    }

    fn score(&self, parameters: &Parameters, trace: &mut Trace) -> Score {
        let rule = self.cases[0].convention.bounds;
        let outcomes = self.cases.iter().map(|case| (Self::outcome(case, parameters, trace), case.s.len()));
        Score::of(outcomes, &self.gof, rule)
    }
}

impl Evaluator for Reference {
    fn variant(&self) -> &Variant {
        &self.variant
    }

    fn name(&self) -> &'static str {
        "reference"
    }

    fn precision(&self) -> &'static str {
        "f64"
    }

    fn evaluate(&mut self, population: &Population, scores: &mut [Score]) -> Result<(), EvaluateError> {
        if scores.len() != population.len() {
            return Err(EvaluateError::Room { candidates: population.len(), scores: scores.len() });
        }
        let this = &*self;
        scores.par_iter_mut().enumerate().for_each_init(Trace::default, |trace, (i, score)| {
            *score = this.score(&population.parameters(i), trace);
        });
        Ok(())
    }

    fn outcomes(&mut self, parameters: &Parameters) -> Result<Vec<Outcome>, EvaluateError> {
        let mut trace = Trace::default();
        Ok(self.cases.iter().map(|case| Self::outcome(case, parameters, &mut trace)).collect())
    }
}
