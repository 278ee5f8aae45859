//! Putting right what was adopted before: an exchange against relatives, and what is not needed any more goes.

use super::adopt::{Rival, Search, missing};
use crate::catalog::Variant;
use crate::diagnose::judge::decide::{Evidence, margin_of_relatives, proxy};
use crate::diagnose::judge::fate::Fate;
use crate::diagnose::judge::gate::gate;
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::likelihood::model::is_rugged;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::outcome::Tried;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, CrossValidated, FittedModel};
use crate::diagnose::search::screen::{ScreenedCause, explain};
use crate::diagnose::search::search_budget::SearchBudget;
use crate::extension::Extension;
use rayon::prelude::*;

/// A model in which the cause adopted last stands beside a relative of one before it.
struct Beside {
    /// The one before it, and the relative.
    of: &'static Extension,
    cause: &'static Extension,
    candidate: FittedModel,
    held: CrossValidated,
    /// Evidence and need of the relative, and of the cause adopted last.
    evidence: [(f64, f64); 2],
}

impl Search {
    /// Puts each adopted cause that has relatives, or a size that goes in jumps, right: the likeliest of them takes its place, and those
    /// as likely are its rivals.
    ///
    /// # Errors
    /// As [`explain`].
    pub fn swap(&mut self, setting: &Context<'_>, spending: &SearchBudget) -> Result<(), DiagnoseError> {
        let spending = &spending.inflated(self.inflation);
        self.beside_rivals(setting, spending)?;
        for place in 0..self.current.causes.len() {
            let cause = self.current.causes[place];
            let relatives: Vec<&'static Extension> = setting
                .question
                .causes
                .iter()
                .copied()
                .filter(|other| {
                    *other != cause && other.family() == cause.family() && !self.current.causes.contains(other)
                })
                .collect();
            // A size on which innovations depend in jumps is found next to what else is missing, and cannot follow when more is found.
            if !is_rugged(cause) && (relatives.is_empty() || cause.family() == cause.name) {
                continue;
            }
            let Some(reduced) = without(&self.current, setting, cause, spending)? else { continue };
            let missing = missing(&reduced)?;
            let again: Vec<&'static Extension> = relatives.into_iter().chain([cause]).collect();
            let found: Result<Vec<_>, DiagnoseError> = again
                .par_iter()
                .map(|cause| {
                    Ok(explain(setting, &reduced, cause, &missing, spending)?.ok().map(|found| (*cause, found)))
                })
                .collect();
            let mut found: Vec<ScreenedCause> = found?.into_iter().flatten().collect();
            found.retain(|(cause, candidate)| proxy(candidate, cause).is_none());
            let best = found.iter().map(|(_, c)| c.fit.log_likelihood).fold(self.current.fit.log_likelihood, f64::max);
            let margin = margin_of_relatives(self.margin, best - reduced.fit.log_likelihood);
            let near = |candidate: &FittedModel| best - candidate.fit.log_likelihood <= margin;
            // What stays unless another is likelier by more than its further parameters could be worth, or has fewer and is as
            // likely, as when it was chosen.
            let per_parameter = (0.5 * self.margin).max(2.0);
            let penalty = |cause: &Extension| per_parameter * cause.parameters.len() as f64;
            let mine = self.current.fit.log_likelihood - penalty(cause);
            found.sort_by(|a, b| {
                (b.1.fit.log_likelihood - penalty(b.0)).total_cmp(&(a.1.fit.log_likelihood - penalty(a.0)))
            });
            let (mut keeps, mut settled) = (cause, false);
            let threshold = self.evidence[place].1;
            let reduced_held = reduced.cross_fit(setting)?;
            let mut rivals = Vec::new();
            let order = self.current.causes.clone();
            for (other, mut candidate) in found {
                // The order of adoption is kept, in which the evidence is.
                candidate.causes = order.iter().map(|c| if *c == cause { other } else { *c }).collect();
                let value = candidate.fit.log_likelihood - penalty(other);
                let better = !settled && (other == cause || value > mine + 2.0) && value > mine;
                if !(better || near(&candidate)) {
                    continue;
                }
                // As when it is adopted: judged where it was not fitted, and on the hold-out.
                let held = candidate.cross_fit(setting)?;
                let evidence = Evidence::of(setting, &candidate, other, &held, &reduced, &reduced_held);
                let sound = evidence.objection(threshold).is_none();
                if better && sound && (other == cause || gate(setting, &candidate, other, &reduced, None)?.is_none()) {
                    (keeps, settled) = (other, true);
                    self.evidence[place] = (evidence.counts(), threshold);
                    self.held = held;
                    self.current = candidate;
                } else if sound && near(&candidate) {
                    // The one that gives way as well; who keeps its place is no rival of itself.
                    rivals.push(Rival {
                        of: other,
                        cause: other,
                        candidate,
                        evidence: evidence.counts(),
                        need: threshold,
                    });
                }
            }
            self.note_exchange(cause, keeps);
            self.settle_rivals(cause, keeps, rivals);
        }
        Ok(())
    }

    /// A size that goes in jumps, if that was adopted last, searched beside the relatives that were as likely as a cause before it, too:
    /// beside the wrong one of two it is a little off, and beside a size that is a little off no other relative is likelier. If one
    /// is now, it takes the place of that cause.
    fn beside_rivals(&mut self, setting: &Context<'_>, spending: &SearchBudget) -> Result<(), DiagnoseError> {
        let Some((&last, before)) = self.current.causes.split_last() else { return Ok(()) };
        if !is_rugged(last) {
            return Ok(());
        }
        // Fitted where the last one was not there yet, next to what is still there.
        let beside = |rival: &&mut Rival| {
            let there = before.iter().map(|cause| if *cause == rival.of { rival.cause } else { *cause });
            rival.cause.family() == rival.of.family() && there.eq(rival.candidate.causes.iter().copied())
        };
        let mut likeliest: Option<Beside> = None;
        for rival in self.rivals.iter_mut().filter(beside) {
            let missing = missing(&rival.candidate)?;
            let Ok(found) = explain(setting, &rival.candidate, last, &missing, spending)? else { continue };
            let least = match &likeliest {
                Some(best) => best.candidate.fit.log_likelihood,
                None => self.current.fit.log_likelihood + self.margin,
            };
            let named = [rival.cause, last].iter().all(|cause| proxy(&found, cause).is_none());
            if found.fit.log_likelihood <= least || !named {
                continue;
            }
            let (held, rival_held) = (found.cross_fit(setting)?, rival.candidate.cross_fit(setting)?);
            let evidence = Evidence::of(setting, &found, last, &held, &rival.candidate, &rival_held);
            let need = self.evidence.last().expect("one for each cause").1;
            // The relative was as likely, but its hold-out may have objected to it.
            let carries_over =
                |cause, without| Ok::<_, DiagnoseError>(gate(setting, &found, cause, without, None)?.is_none());
            let Some(alone) = without(&found, setting, rival.cause, spending)? else { continue };
            if evidence.objection(need).is_none()
                && carries_over(last, &rival.candidate)?
                && carries_over(rival.cause, &alone)?
            {
                let evidence = [(rival.evidence, rival.need), (evidence.counts(), need)];
                likeliest = Some(Beside { of: rival.of, cause: rival.cause, candidate: found, held, evidence });
            }
        }
        let Some(Beside { of, cause, candidate, held, evidence }) = likeliest else { return Ok(()) };
        let place = before.iter().position(|other| *other == of).expect("the rival is of a cause that is there");
        self.evidence[place] = evidence[0];
        *self.evidence.last_mut().expect("one for each cause") = evidence[1];
        (self.current, self.held) = (candidate, held);
        self.note_exchange(of, cause);
        self.settle_rivals(of, cause, Vec::new());
        Ok(())
    }

    /// The rivals of a place that was put right: relatives were tried again, and `again` are those as likely; all others stay.
    pub(crate) fn settle_rivals(
        &mut self,
        cause: &'static Extension,
        keeps: &'static Extension,
        mut again: Vec<Rival>,
    ) {
        self.rivals.retain(|rival| rival.of != cause || rival.cause.family() != cause.family());
        again.retain(|rival| rival.cause != keeps);
        again.iter_mut().for_each(|rival| rival.of = keeps);
        self.rivals.iter_mut().filter(|rival| rival.of == cause).for_each(|rival| rival.of = keeps);
        self.rivals.append(&mut again);
    }

    /// Tells the ladder that one cause took the place of another: in the round in which that was adopted, where it was tried as well.
    pub(crate) fn note_exchange(&mut self, cause: &'static Extension, keeps: &'static Extension) {
        if keeps == cause {
            return;
        }
        let adopted = |row: &&mut Tried| row.name == cause.name && row.fate.is_adopted();
        let Some(row) = self.ladder.iter_mut().find(adopted) else { return };
        row.fate = Fate::Exchanged { by: keeps.name.clone() };
        let round = row.round;
        // It could not be tried there, perhaps: then where it was.
        let tried = |row: &Tried| row.name == keeps.name;
        let there = self.ladder.iter().position(|row| tried(row) && row.round == round);
        if let Some(k) = there.or_else(|| self.ladder.iter().rposition(tried)) {
            self.ladder[k].fate = Fate::Adopted;
        }
    }

    /// Drops every cause whose removal costs less than the threshold, and those that are no name any more: what was found later may
    /// have moved them, to a bound for example. After each all others are looked at again. True if there was one of the latter.
    ///
    /// # Errors
    /// As [`FittedModel::fitted`].
    pub fn prune(&mut self, setting: &Context<'_>, spending: &SearchBudget) -> Result<bool, DiagnoseError> {
        let (mut place, mut lost) = (0, false);
        // The evidence of a single cause is what its removal costs already.
        let single = self.current.causes.len() == 1;
        while place < self.current.causes.len() {
            let cause = self.current.causes[place];
            let objection = proxy(&self.current, cause);
            if objection.is_none() && single {
                break;
            }
            let Some(reduced) = without(&self.current, setting, cause, spending)? else {
                place += 1;
                continue;
            };
            let held = reduced.cross_fit(setting)?;
            let evidence = Evidence::of(setting, &self.current, cause, &self.held, &reduced, &held).counts();
            let need = self.evidence[place].1;
            if objection.is_none() && evidence >= need {
                self.evidence[place].0 = evidence;
                place += 1;
                continue;
            }
            self.current = reduced;
            self.held = held;
            self.evidence.remove(place);
            self.rivals.retain(|rival| rival.of != cause);
            for row in self.ladder.iter_mut().filter(|row| row.fate.is_adopted() && row.name == cause.name) {
                row.fate = match &objection {
                    Some(objection) => Fate::NoNameAnyMore(objection.clone()),
                    None => Fate::Dropped { cost: evidence },
                };
            }
            if let Some(objection) = objection {
                self.lost.push((cause, self.current.causes[..place].to_vec()));
                self.stopped.push((cause, evidence, need, objection));
                lost = true;
            }
            // What the others cost beside it says nothing any more.
            place = 0;
        }
        Ok(lost)
    }
}

/// A model without one of its causes, refitted.
pub(crate) fn without(
    current: &FittedModel,
    setting: &Context<'_>,
    cause: &'static Extension,
    spending: &SearchBudget,
) -> Result<Option<FittedModel>, DiagnoseError> {
    let variant = Variant { extensions: current.variant.extensions.without(&cause.name), ..current.variant };
    let causes: Vec<&'static Extension> = current.causes.iter().copied().filter(|c| *c != cause).collect();
    let events: Vec<_> = current.model.events.iter().copied().filter(|event| event.extension != cause).collect();
    let model = setting.model(variant, &events)?;
    let values = model.adopt(&current.model, &current.fit.point.values);
    let noise = current.fit.point.noise;
    let strong = Noise { sigma_d: noise.sigma_d.max(0.1), tau_d: 2.0, ..noise };
    let free = noise.nearly_free();
    let starts: Vec<Point> =
        [noise, strong, free].into_iter().map(|noise| Point { values: values.clone(), noise }).collect();
    let plan = Plan {
        select: starts.len(),
        kinds: 1,
        rough: 5,
        keep: 2,
        fine: spending.base.fine,
        tolerance: 0.1,
        least: [0.0; 2],
    };
    FittedModel::fitted(setting, variant, &causes, model, &starts, plan)
}
