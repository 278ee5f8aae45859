//! The reference as an evaluator: one candidate after the other, spread over threads.

use super::extension::untranscribed;
use super::simulate::{Run, Trace, simulate};
use crate::convention::Denominators;
use crate::evaluator::{BufferSet, Case, EvaluateError, Evaluator, Job, Outcome, Score};
use crate::score::{GoodnessOfFit, Measures, SignalMeasures};
use crate::symbols::Parameters;
use rayon::prelude::*;

/// The f64 reference evaluator of one variant over one or several cases.
#[derive(Debug, Clone)]
pub struct Reference {
    cases: Vec<Case>,
    gof: GoodnessOfFit,
    scores: [Vec<Score>; 2],
}

impl Reference {
    /// An evaluator of these cases; the score is that of `gof` over all of them. Panics without cases, or if they were prepared for different
    /// variants.
    pub fn new(cases: Vec<Case>, gof: GoodnessOfFit) -> Reference {
        let variant = cases.first().expect("at least one case").variant;
        assert!(cases.iter().all(|c| c.variant == variant), "cases of one variant");
        Reference { cases, gof, scores: [Vec::new(), Vec::new()] }
    }

    /// Simulates one candidate on one case and measures it. Panics with an extension that has no transcription: see [`super::knows`].
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

    /// The score of one candidate over all cases.
    pub fn score(&self, parameters: &Parameters) -> Score {
        let mut trace = Trace::default();
        let outcomes =
            self.cases.iter().map(|case| (Self::outcome(case, parameters, &mut trace), case.share(&self.gof)));
        // All cases have one convention: see `Case`.
        let bounds = self.cases.first().expect("an evaluator has a case").convention.bounds;
        Score::of(outcomes, &self.gof, bounds)
    }

    /// The outcomes of all candidates of the jobs, spread over threads.
    fn run<T: Send>(
        &self,
        jobs: &[Job<'_>],
        finish: impl Fn(&Case, Outcome) -> T + Sync,
        results: &mut Vec<T>,
    ) -> Result<(), EvaluateError> {
        results.clear();
        let variant = self.variant();
        if let Some(extension) = untranscribed(variant) {
            let (extension, variant) = (extension.name.clone(), variant.name());
            return Err(EvaluateError::Untranscribed { extension, variant });
        }
        for job in jobs {
            let case = &self.cases[job.case];
            let simulated = (0..job.population.len()).into_par_iter().map_init(Trace::default, |trace, i| {
                finish(case, Self::outcome(case, &job.population.parameters(i), trace))
            });
            results.par_extend(simulated);
        }
        Ok(())
    }
}

impl Evaluator for Reference {
    fn cases(&self) -> &[Case] {
        &self.cases
    }

    fn gof(&self) -> &GoodnessOfFit {
        &self.gof
    }

    fn name(&self) -> &'static str {
        "reference"
    }

    fn precision(&self) -> &'static str {
        "f64"
    }

    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        let mut scores = std::mem::take(&mut self.scores[set as usize]);
        let gof = self.gof;
        let result = self.run(jobs, |case, outcome| outcome.score(&gof, case.convention.bounds), &mut scores);
        self.scores[set as usize] = scores;
        result
    }

    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        let computed = &self.scores[set as usize];
        if scores.len() != computed.len() {
            return Err(EvaluateError::Room { candidates: computed.len(), scores: scores.len() });
        }
        scores.copy_from_slice(computed);
        Ok(())
    }

    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError> {
        let mut outcomes = Vec::new();
        self.run(jobs, |_, outcome| outcome, &mut outcomes)?;
        Ok(outcomes)
    }
}
