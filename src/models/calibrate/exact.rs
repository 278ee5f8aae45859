//! Scores in f64 for the few candidates that f32 cannot rank.

use crate::evaluator::{BufferSet, EvaluateError, Evaluator, Job, Score};
use crate::lanes::{Lanes, LanesPrecision};

/// The f64 evaluator on the CPU, whatever simulates the bulk; made at its first use.
#[derive(Debug, Default)]
pub(super) struct Exact {
    lanes: Option<Lanes>,
}

impl Exact {
    /// Scores jobs for the cases of an evaluator.
    pub(super) fn evaluate(
        &mut self,
        evaluator: &dyn Evaluator,
        jobs: &[Job<'_>],
        scores: &mut [Score],
    ) -> Result<(), EvaluateError> {
        if self.lanes.is_none() {
            self.lanes = Some(Lanes::new(evaluator.cases().to_vec(), *evaluator.gof(), LanesPrecision::F64)?);
        }
        let lanes = self.lanes.as_mut().expect("made above");
        lanes.submit(BufferSet::A, jobs)?;
        lanes.collect(BufferSet::A, scores)
    }
}
