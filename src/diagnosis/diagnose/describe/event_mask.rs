//! Events of one recording: on other recordings their causes do nothing.

use crate::diagnose::drive::Drive;
use crate::diagnose::outcome::Adopted;
use crate::evaluator::{BufferSet, EvaluateError, Evaluator, Job, Outcome, Population, Score};
use crate::lanes::Lanes;
use crate::symbols::Symbol;

/// Parameters of the events that a drive lacks, with the values at which they do nothing.
pub fn absent(adopted: &[Adopted], drive: &Drive) -> Vec<(Symbol, f64)> {
    let recording = drive.recording();
    let elsewhere = adopted.iter().filter(|cause| cause.recording.as_ref().is_some_and(|own| *own != recording));
    let symbols = elsewhere.flat_map(|cause| &cause.extension.parameters);
    symbols.filter_map(|symbol| symbol.neutral().map(|neutral| (*symbol, neutral))).collect()
}

/// Evaluates candidates with parameters that do nothing in some of the cases. (A calibration checks the feasibility of its result with the
/// events in all cases; otherwise it takes a neighbour that is as good.)
pub struct EventMask {
    lanes: Lanes,
    absent: Vec<Vec<(Symbol, f64)>>,
}

impl EventMask {
    /// Takes lanes in f64, so that no other evaluator scores a candidate of a search, and the absent parameters of each case.
    pub fn new(lanes: Lanes, absent: Vec<Vec<(Symbol, f64)>>) -> EventMask {
        EventMask { lanes, absent }
    }

    /// The candidates of a job with the absent parameters of its case replaced.
    fn here(&self, job: &Job<'_>) -> Population {
        let symbols = job.population.symbols();
        let mut here = Population::new(symbols);
        for candidate in 0..job.population.len() {
            let mut values = job.population.values(candidate).to_vec();
            for (symbol, neutral) in &self.absent[job.case] {
                symbols.iter().zip(&mut values).filter(|(s, _)| *s == symbol).for_each(|(_, value)| *value = *neutral);
            }
            here.push(&values);
        }
        here
    }
}

/// The same jobs with other candidates.
fn with<'a>(jobs: &[Job<'_>], here: &'a [Population]) -> Vec<Job<'a>> {
    jobs.iter().zip(here).map(|(job, population)| Job { case: job.case, population }).collect()
}

impl Evaluator for EventMask {
    leadlag_models::forward_evaluator!(lanes: cases, gof, name, precision);

    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        let here: Vec<Population> = jobs.iter().map(|job| self.here(job)).collect();
        self.lanes.submit(set, &with(jobs, &here))
    }

    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        self.lanes.collect(set, scores)
    }

    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError> {
        let here: Vec<Population> = jobs.iter().map(|job| self.here(job)).collect();
        self.lanes.outcomes(&with(jobs, &here))
    }
}
