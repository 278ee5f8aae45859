//! Putting right what was adopted before: an exchange against relatives, and what is not needed any more goes.

use super::adopt::{Rival, Search, family, missing};
use super::candidate::{Candidate, Setting};
use super::decide::{Evidence, margin_of_relatives, proxy};
use super::fate::Fate;
use super::fit::{Plan, Point};
use super::gate::gate;
use super::observer::Noise;
use super::polish::is_rugged;
use super::screen::{Fitted, Spending, explain};
use super::verdict::{DiagnoseError, Tried};
use crate::catalog::Variant;
use crate::extension::Extension;
use rayon::prelude::*;

impl Search {
    /// Puts each adopted cause that has relatives, or a size that goes in jumps, right: the likeliest of them takes its place, and those
    /// as likely are its rivals.
    ///
    /// # Errors
    /// As [`explain`].
    pub fn swap(&mut self, setting: &Setting<'_>, spending: &Spending) -> Result<(), DiagnoseError> {
        for place in 0..self.current.causes.len() {
            let cause = self.current.causes[place];
            let relatives: Vec<&'static Extension> = setting
                .question
                .causes
                .iter()
                .copied()
                .filter(|other| {
                    *other != cause && family(other) == family(cause) && !self.current.causes.contains(other)
                })
                .collect();
            // A size on which innovations depend in jumps is found next to what else is missing, and cannot follow when more is found.
            if !is_rugged(cause) && (relatives.is_empty() || family(cause) == cause.name) {
                continue;
            }
            let Some(mut reduced) = self.without(setting, cause, spending)? else { continue };
            let missing = missing(&mut reduced)?;
            let again: Vec<&'static Extension> = relatives.into_iter().chain([cause]).collect();
            let found: Result<Vec<_>, DiagnoseError> = again
                .par_iter()
                .map(|cause| {
                    Ok(explain(setting, &reduced, cause, &missing, spending)?.ok().map(|found| (*cause, found)))
                })
                .collect();
            let mut found: Vec<Fitted> = found?.into_iter().flatten().collect();
            found.retain(|(cause, candidate)| proxy(candidate, cause).is_none());
            let best = found.iter().map(|(_, c)| c.fit.log_likelihood).fold(self.current.fit.log_likelihood, f64::max);
            let margin = margin_of_relatives(self.margin, best - reduced.fit.log_likelihood);
            let near = |candidate: &Candidate| best - candidate.fit.log_likelihood <= margin;
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
            for (other, mut candidate) in found {
                let value = candidate.fit.log_likelihood - penalty(other);
                let better = !settled && (other == cause || value > mine + 2.0) && value > mine;
                if !(better || near(&candidate)) {
                    continue;
                }
                // As when it is adopted: judged where it was not fitted, and on the hold-out.
                let held = candidate.cross_fit(setting)?;
                let evidence = Evidence::of(setting, &candidate, other, &held, &reduced, &reduced_held);
                let sound = evidence.objection(threshold).is_none();
                if better && sound && (other == cause || gate(setting, &candidate, other, &reduced)?.is_none()) {
                    (keeps, settled) = (other, true);
                    // The order of adoption is kept.
                    candidate.causes =
                        self.current.causes.iter().map(|c| if *c == cause { other } else { *c }).collect();
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

    /// The rivals of a place that was put right: relatives were tried again, and `again` are those as likely; all others stay.
    pub(super) fn settle_rivals(
        &mut self,
        cause: &'static Extension,
        keeps: &'static Extension,
        mut again: Vec<Rival>,
    ) {
        self.rivals.retain(|rival| rival.of != cause || family(rival.cause) != family(cause));
        again.retain(|rival| rival.cause != keeps);
        again.iter_mut().for_each(|rival| rival.of = keeps);
        self.rivals.iter_mut().filter(|rival| rival.of == cause).for_each(|rival| rival.of = keeps);
        self.rivals.append(&mut again);
    }

    /// Tells the ladder that one cause took the place of another: in the round in which that was adopted, where it was tried as well.
    pub(super) fn note_exchange(&mut self, cause: &'static Extension, keeps: &'static Extension) {
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

    /// The model without one of its causes, refitted.
    pub(super) fn without(
        &self,
        setting: &Setting<'_>,
        cause: &'static Extension,
        spending: &Spending,
    ) -> Result<Option<Candidate>, DiagnoseError> {
        let current = &self.current;
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
        let plan =
            Plan { select: 3, kinds: 1, rough: 5, keep: 2, fine: spending.base.fine, tolerance: 0.1, least: [0.0; 2] };
        Candidate::fitted(setting, variant, &causes, model, &starts, plan)
    }

    /// Drops every cause whose removal costs less than the threshold, and those that are no name any more: what was found later may
    /// have moved them, to a bound for example. After one of these all others are looked at again. True if there was one.
    ///
    /// # Errors
    /// As [`Candidate::fitted`].
    pub fn prune(&mut self, setting: &Setting<'_>, spending: &Spending) -> Result<bool, DiagnoseError> {
        let (mut place, mut lost) = (0, false);
        while place < self.current.causes.len() {
            let cause = self.current.causes[place];
            let objection = proxy(&self.current, cause);
            if objection.is_none() && self.current.causes.len() == 1 {
                break;
            }
            let Some(mut reduced) = self.without(setting, cause, spending)? else {
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
                self.stopped.push((cause, evidence, need, objection));
                (place, lost) = (0, true);
            }
        }
        Ok(lost)
    }
}
