//! One case of an evaluator of many.

use super::{BufferSet, Case, EvaluateError, Evaluator, Job, Outcome, Score};
use crate::score::GoodnessOfFit;

/// An evaluator that shows one case of another one, which computes.
pub struct View<'a> {
    inner: &'a mut dyn Evaluator,
    case: usize,
    /// The one case.
    shown: Vec<Case>,
}

impl<'a> View<'a> {
    /// The case of this number alone.
    ///
    /// # Panics
    /// Unless the evaluator has such a case.
    pub fn new(inner: &'a mut dyn Evaluator, case: usize) -> View<'a> {
        let shown = vec![inner.cases()[case].clone()];
        View { inner, case, shown }
    }

    fn there<'j>(&self, jobs: &[Job<'j>]) -> Vec<Job<'j>> {
        jobs.iter().map(|job| Job { case: self.case, population: job.population }).collect()
    }
}

impl Evaluator for View<'_> {
    fn cases(&self) -> &[Case] {
        &self.shown
    }

    fn gof(&self) -> &GoodnessOfFit {
        self.inner.gof()
    }

    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn precision(&self) -> &'static str {
        self.inner.precision()
    }

    fn adapter(&self) -> Option<String> {
        self.inner.adapter()
    }

    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        let jobs = self.there(jobs);
        self.inner.submit(set, &jobs)
    }

    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        self.inner.collect(set, scores)
    }

    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError> {
        let jobs = self.there(jobs);
        self.inner.outcomes(&jobs)
    }
}
