//! An evaluator that another one replaces when it fails, without losing the generation under way.

use super::splitting::OwnJobs;
use super::{BufferSet, Case, Differences, EvaluateError, Evaluator, Job, Outcome, Score, Slopes, Timings};

/// Makes the second evaluator once the first has failed, and may report why.
pub type Replace = Box<dyn FnMut(&EvaluateError, Vec<Case>) -> Result<Box<dyn Evaluator>, EvaluateError> + Send>;

/// A first evaluator, and its replacement after a failure.
pub struct Fallback {
    current: Box<dyn Evaluator>,
    replace: Option<Replace>,
    /// Jobs that have been submitted and not yet collected.
    pending: [OwnJobs; 2],
    /// The sets that have been submitted and not collected.
    under_way: [bool; 2],
    /// Time that the failed evaluator spent besides computing.
    spent: Timings,
}

impl Fallback {
    /// Starts with `first`; if it fails, `replace` makes the second one.
    pub fn new(first: Box<dyn Evaluator>, replace: Replace) -> Fallback {
        let (pending, under_way, spent) = (Default::default(), [false; 2], Timings::default());
        Fallback { current: first, replace: Some(replace), pending, under_way, spent }
    }

    /// Puts the second evaluator in place and submits all unfinished work to it.
    fn recover(&mut self, error: EvaluateError) -> Result<(), EvaluateError> {
        // Wrong use fails on every evaluator; a lost device may take its adapter with it.
        use EvaluateError::{Adapter, Device, Memory};
        if !matches!(error, Device { .. } | Adapter { .. } | Memory { .. }) {
            return Err(error);
        }
        let Some(mut replace) = self.replace.take() else { return Err(error) };
        let second = replace(&error, self.current.cases().to_vec())?;
        self.spent = self.spent + self.current.timings();
        self.current = second;
        for set in [BufferSet::A, BufferSet::B] {
            if self.under_way[set as usize] {
                self.current.submit(set, &self.pending[set as usize].borrowed())?;
            }
        }
        Ok(())
    }
}

impl Evaluator for Fallback {
    crate::forward_evaluator!(current: cases, gof, name, precision, adapter, overlaps);

    fn timings(&self) -> Timings {
        self.spent + self.current.timings()
    }

    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        self.pending[set as usize].keep(jobs);
        self.under_way[set as usize] = true;
        match self.current.submit(set, jobs) {
            Ok(()) => Ok(()),
            Err(error) => self.recover(error),
        }
    }

    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        if let Err(error) = self.current.collect(set, scores) {
            self.recover(error)?;
            self.current.collect(set, scores)?;
        }
        self.under_way[set as usize] = false;
        Ok(())
    }

    fn slopes(&mut self, job: &Job<'_>, differences: &[Differences]) -> Result<Option<Vec<Slopes>>, EvaluateError> {
        match self.current.slopes(job, differences) {
            Err(error) => {
                self.recover(error)?;
                self.current.slopes(job, differences)
            }
            found => found,
        }
    }

    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError> {
        match self.current.outcomes(jobs) {
            Ok(outcomes) => Ok(outcomes),
            Err(error) => {
                self.recover(error)?;
                self.current.outcomes(jobs)
            }
        }
    }
}
