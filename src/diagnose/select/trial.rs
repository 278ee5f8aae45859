//! Causes on trial: where two are missing, one of them alone may carry over to the hold-out badly.

use super::adopt::Search;
use crate::diagnose::judge::fate::{Fate, Objection};
use crate::diagnose::judge::gate::{TRANSFERS, transfers};
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, CrossValidated, FittedModel};
use crate::diagnose::search::screen::ScreenedCause;
use crate::extension::Extension;

/// So many times what it needs gains a cause that is taken along although the hold-out objects to it alone. (A real car's answer to the
/// acceleration of the car ahead had 2.8 times, and 22 times beside the delay that was missing as well.)
const TAKEN_ALONG: f64 = 2.5;

/// A cause that the hold-out objects to, taken along on trial.
#[derive(Debug)]
pub struct Trial {
    cause: &'static Extension,
    /// Where the search stood before it.
    before: FittedModel,
    held: CrossValidated,
    evidence: Vec<(f64, f64)>,
    stopped: Vec<(&'static Extension, f64, f64, Objection)>,
    /// What had become of everything tried by then.
    fates: Vec<Fate>,
    /// Threshold, margin and inflation of its round.
    need: f64,
    margin: f64,
    inflation: f64,
}

impl Search {
    /// The likeliest cause, where the hold-out is all that speaks against it and training speaks for it that loudly; one at most.
    pub(crate) fn worth_a_trial(&self, tried: &[ScreenedCause]) -> Option<usize> {
        let likeliest = self.stopped.iter().max_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| self.trial.is_none())?;
        let (cause, evidence, need, objection) = likeliest;
        let worth = *evidence > TAKEN_ALONG * need && matches!(objection, Objection::NoTransfer { .. });
        worth.then(|| tried.iter().position(|(other, _)| other == cause)).flatten()
    }

    /// Notes that the cause adopted last is on trial, and what was before it; `ladder` is the first row of its round.
    pub(crate) fn begin_trial(
        &mut self,
        before: FittedModel,
        held: CrossValidated,
        evidence: Vec<(f64, f64)>,
        ladder: usize,
    ) {
        let cause = *self.current.causes.last().expect("just adopted");
        let fates = self.ladder.iter().map(|row| row.fate.clone()).collect();
        for row in self.ladder.iter_mut().skip(ladder).filter(|row| row.name == cause.name) {
            if let Fate::Stopped(objection) = &row.fate {
                row.fate = Fate::OnTrial(objection.clone());
            }
        }
        let stopped = std::mem::take(&mut self.stopped);
        let Search { need, margin, inflation, .. } = *self;
        self.trial = Some(Trial { cause, before, held, evidence, stopped, fates, need, margin, inflation });
    }

    /// Ends a trial: with what was found next to it the whole has to carry over to the hold-out, or everything is as it was before.
    ///
    /// # Errors
    /// As [`transfers`].
    pub fn end_trial(&mut self, setting: &Context<'_>) -> Result<(), DiagnoseError> {
        let Some(trial) = self.trial.take() else { return Ok(()) };
        let known = &trial.before.causes;
        // What was there before may have become needless, or been exchanged, beside the new ones.
        let new = self.current.causes.iter().filter(|cause| !known.contains(cause)).count();
        if new > 1 && transfers(setting, &self.current, trial.cause, &trial.before, None)?.0 >= TRANSFERS {
            return Ok(());
        }
        for row in self.ladder.iter_mut().skip(trial.fates.len()) {
            if row.fate.is_adopted() || row.fate.is_dropped() {
                row.fate = match trial.stopped.iter().find(|(cause, ..)| cause.name == row.name) {
                    Some((.., objection)) => Fate::Stopped(objection.clone()),
                    None => Fate::OnlyNextTo { other: trial.cause.name.clone() },
                };
            }
        }
        self.ladder.iter_mut().zip(trial.fates).for_each(|(row, fate)| row.fate = fate);
        self.rivals.retain(|rival| known.contains(&rival.of));
        (self.current, self.held, self.stopped) = (trial.before, trial.held, trial.stopped);
        self.evidence = trial.evidence;
        (self.need, self.margin, self.inflation) = (trial.need, trial.margin, trial.inflation);
        Ok(())
    }
}
