//! Causes that hide each other, and are found together or not at all.

use super::adopt::{Search, missing};
use super::repair::without;
use crate::diagnose::judge::decide::{Evidence, proxy};
use crate::diagnose::judge::fate::{Fate, Objection};
use crate::diagnose::judge::gate::gate;
use crate::diagnose::likelihood::model::PHASE;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::Context;
use crate::diagnose::search::screen::{ScreenedCause, explain};
use crate::diagnose::search::search_budget::SearchBudget;
use crate::extension::Extension;
use rayon::prelude::*;

impl Search {
    /// Tries each member of the phase family together with the cause that hides it, where one is in the model without it, or, if `puzzled`,
    /// without either. (A delay of tau takes tau k_v a_l from a command that answers to the leader's speed by k_v, and an answer to the leader's
    /// acceleration puts it back: a car that has both may show neither of them, or a lag that it has not.) True if the two explain more than what is there; it has made way for them then.
    ///
    /// # Errors
    /// As [`explain`].
    pub fn pair_up(
        &mut self,
        setting: &Context<'_>,
        spending: &SearchBudget,
        puzzled: bool,
    ) -> Result<bool, DiagnoseError> {
        let spending = &spending.inflated(self.inflation);
        let phase = self.current.causes.iter().copied().find(|cause| cause.family() == PHASE);
        let hides =
            |cause: &&'static Extension| cause.cause.as_ref().is_some_and(|c| c.hides.as_deref() == Some(PHASE));
        let answer = setting.question.causes.iter().copied().find(hides);
        let answer = answer.filter(|answer| !self.current.causes.contains(answer) && (puzzled || phase.is_some()));
        let Some(answer) = answer else { return Ok(false) };
        let mut reduced = None;
        if let Some(phase) = phase {
            reduced = without(&self.current, setting, phase, spending)?;
            if reduced.is_none() {
                return Ok(false);
            }
        }
        let from = reduced.as_ref().unwrap_or(&self.current);
        let lacks = missing(from)?;
        let Ok(answered) = explain(setting, from, answer, &lacks, spending)? else { return Ok(false) };
        let lacks = missing(&answered)?;
        let members = setting.question.causes.par_iter().copied().filter(|cause| cause.family() == PHASE);
        let tried = members.map(|member| Ok((member, explain(setting, &answered, member, &lacks, spending)?.ok())));
        let tried: Result<Vec<_>, DiagnoseError> = tried.collect();
        let sound = |(member, candidate): &ScreenedCause| {
            [*member, answer].iter().all(|cause| proxy(candidate, cause).is_none())
        };
        let found = tried?.into_iter().filter_map(|(member, found)| Some((member, found?))).filter(sound);
        let best = found.max_by(|a, b| a.1.fit.log_likelihood.total_cmp(&b.1.fit.log_likelihood));
        let Some((member, best)) = best else { return Ok(false) };
        if best.fit.log_likelihood <= self.current.fit.log_likelihood + self.need {
            return Ok(false);
        }
        let held = best.cross_fit(setting)?;
        let evidence = Evidence::of(setting, &best, answer, &held, &self.current, &self.held);
        // What is less likely than something that a calibration makes up for is no name, and two are none either.
        let absorbed = self.stopped.iter().filter(|(.., objection)| matches!(objection, Objection::Absorbed { .. }));
        let made_up_for = absorbed.map(|(_, evidence, ..)| *evidence).fold(0.0, f64::max);
        if evidence.objection(self.need).is_some()
            || evidence.counts() < made_up_for
            || gate(setting, &best, answer, &self.current, None)?.is_some()
        {
            return Ok(false);
        }
        if let Some(phase) = phase {
            self.evidence.remove(self.current.causes.iter().position(|cause| *cause == phase).expect("found above"));
            self.rivals.retain(|rival| rival.of != phase);
            self.note_exchange(phase, member);
        }
        // What each of them is worth next to the other is found out when those that are not needed are dropped.
        self.evidence.extend([(evidence.counts(), self.need); 2]);
        for (cause, with) in [(answer, member), (member, answer)] {
            let row = self.ladder.iter_mut().rfind(|row| row.name == cause.name && !row.fate.is_adopted());
            if let Some(row) = row.filter(|_| phase != Some(cause)) {
                row.fate = Fate::Together { with: with.name.clone() };
                (row.gain, row.evidence) = (evidence.gain, evidence.counts());
                (row.folds, row.trimmed) = (evidence.folds, evidence.trimmed);
            }
        }
        (self.current, self.held) = (best, held);
        Ok(true)
    }
}
