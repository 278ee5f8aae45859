//! Rounds: screen, cross-fit, decide, adopt, put right what was adopted before; and prune at the end.

mod choice;

use super::trial::Trial;
use crate::diagnose::judge::decide::{ABSORBED, is_hopeful, margin, need, residue};
use crate::diagnose::judge::fate::{Fate, Objection};
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::likelihood::model::{PHASE, is_rugged};
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::outcome::{NotTestable, Tried};
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::cmaes_refine::polished;
use crate::diagnose::search::fitted_model::{Context, CrossValidated, FittedModel};
use crate::diagnose::search::profile_grid::within_bounds;
use crate::diagnose::search::screen::{ScreenedCause, identifiability, screen};
use crate::diagnose::search::search_budget::SearchBudget;
use crate::diagnose::search::skipped::Skipped;
use crate::extension::Extension;
use rayon::prelude::*;

/// Rounds at most.
pub const ROUNDS: usize = 5;

/// Screenings of a round at most: where one cause has shown that the present model itself fits better by so much \[nats\], and by this
/// share of what the best cause gains, the others were tried on top of the wrong one.
const SCREENINGS: (usize, f64, f64) = (3, 25.0, 0.25);

/// A cause that could be in the place of an adopted one, fitted there.
#[derive(Debug)]
pub struct Rival {
    /// The cause whose place it is.
    pub of: &'static Extension,
    /// The rival.
    pub cause: &'static Extension,
    /// The model with the rival.
    pub candidate: FittedModel,
    /// Its evidence \[nats\].
    pub evidence: f64,
    /// What was needed.
    pub need: f64,
}

/// Where the search stands.
#[derive(Debug)]
pub struct Search {
    /// The model as far as it is extended.
    pub current: FittedModel,
    /// Its held-out likelihood.
    pub held: CrossValidated,
    /// Log-likelihood of the base without causes \[nats\].
    pub(crate) bare: f64,
    /// Evidence and threshold of each adopted cause, in the order of the model's causes.
    pub evidence: Vec<(f64, f64)>,
    /// Causes that could be in the place of an adopted one.
    pub rivals: Vec<Rival>,
    /// Everything tried.
    pub ladder: Vec<Tried>,
    /// Causes that were no name any more in the end, with those that were before it then: from there it would be found and lost again.
    pub(crate) lost: Vec<(&'static Extension, Vec<&'static Extension>)>,
    /// Causes stopped by sign, bound or hold-out with their evidence \[nats\] and the threshold, of the last round.
    pub stopped: Vec<(&'static Extension, f64, f64, Objection)>,
    /// Causes that the data cannot show.
    pub not_testable: Vec<NotTestable>,
    /// Causes that could not be tried on the base, nor in a later round.
    pub untried: Vec<Skipped>,
    /// Thresholds of the last round \[nats\].
    pub need: f64,
    /// Differences of evidence below this decide nothing between two causes \[nats\].
    pub margin: f64,
    /// Inflation of the last round.
    pub inflation: f64,
    /// Causes that are judged in the present round.
    short_list: usize,
    /// Simulations of the last round.
    pub(crate) last_round: u64,
    /// True if rounds ended because enough was simulated, and not because nothing more was found.
    pub(crate) cut_short: bool,
    /// What was taken along on trial.
    pub(crate) trial: Option<Trial>,
}

/// What a round has found.
#[derive(Debug)]
pub struct Judged {
    /// Everything tried, and the held-out likelihood of what was worth a cross-fit.
    tried: Vec<ScreenedCause>,
    held: Vec<Option<CrossValidated>>,
    /// Position of what is adopted, or taken along on trial.
    adopted: Option<usize>,
    on_trial: Option<usize>,
    /// First row of the round in the ladder.
    ladder: usize,
}

/// The missing acceleration of a candidate on every drive \[m/s²\], as a rather strong observer sees it.
///
/// # Errors
/// As [`crate::diagnose::likelihood::model::Model::innovations`].
pub fn missing(candidate: &FittedModel) -> Result<Vec<Vec<f64>>, DiagnoseError> {
    let noise = candidate.fit.point.noise;
    let seen = Noise { sigma_d: noise.sigma_d.max(0.05), tau_d: 1.0, ..noise };
    let values = candidate.fit.point.values.clone();
    let runs = candidate.model.innovations(&values, &seen)?;
    let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
    Ok(runs.into_iter().map(|run| run.state.iter().map(|state| finite(state[2])).collect()).collect())
}

impl Search {
    /// The search before any round.
    ///
    /// # Errors
    /// As [`FittedModel::cross_fit`].
    pub fn begin(setting: &Context<'_>, base: FittedModel) -> Result<Search, DiagnoseError> {
        let held = base.cross_fit(setting)?;
        let inflation = base.inflation(setting)?;
        Ok(Search {
            bare: base.fit.log_likelihood,
            current: base,
            held,
            evidence: Vec::new(),
            rivals: Vec::new(),
            ladder: Vec::new(),
            lost: Vec::new(),
            stopped: Vec::new(),
            not_testable: Vec::new(),
            untried: Vec::new(),
            need: 0.0,
            margin: 0.0,
            inflation,
            short_list: 0,
            last_round: 0,
            cut_short: false,
            trial: None,
        })
    }

    /// What the adopted causes explain together \[nats\]: the sum of their evidence, but not more than the gain of the whole over the
    /// base. Of causes that hide each other each one's removal costs nearly everything.
    #[must_use]
    pub fn explained(&self) -> f64 {
        let sum: f64 = self.evidence.iter().map(|(evidence, _)| evidence.max(0.0)).sum();
        sum.min((self.current.fit.log_likelihood - self.bare).max(0.0))
    }

    /// True if nothing more is to be looked for after so many simulations: two causes are found, or one and another one that was no name
    /// any more in the end, and with another round like the last one it would be more than enough. Beside the first cause, beside a
    /// single one on trial, and where none is left, the search always goes on.
    pub(crate) fn has_enough(&self, simulated: u64, spending: &SearchBudget) -> bool {
        let found = self.current.causes.len();
        let twice = found > 1 || found == 1 && !self.lost.is_empty() && self.trial.is_none();
        twice && simulated + self.last_round > spending.enough
    }

    /// One round; true if a cause was adopted.
    ///
    /// # Errors
    /// As [`screen`].
    pub fn round(
        &mut self,
        setting: &Context<'_>,
        number: usize,
        spending: &SearchBudget,
    ) -> Result<bool, DiagnoseError> {
        let tried = self.fit_all(setting, spending)?;
        let judged = self.judge(setting, number, tried, spending)?;
        Ok(self.adopt(judged))
    }

    /// The first half of a round: every further cause fitted, the likeliest first, and the present model once more from where they
    /// took it.
    ///
    /// # Errors
    /// As [`screen`].
    pub fn fit_all(
        &mut self,
        setting: &Context<'_>,
        spending: &SearchBudget,
    ) -> Result<Vec<ScreenedCause>, DiagnoseError> {
        let causes = self.to_try(setting.question.causes);
        let spending = &spending.inflated(self.inflation);
        self.off_its_bounds(setting, spending)?;
        let (mut tried, mut dropped) = (Vec::new(), Vec::new());
        for _ in 0..SCREENINGS.0 {
            let missing = missing(&self.current)?;
            (tried, dropped) = screen(setting, &self.current, &causes, &missing, spending)?;
            tried.sort_by(|a, b| b.1.fit.log_likelihood.total_cmp(&a.1.fit.log_likelihood));
            let before = self.current.fit.log_likelihood;
            self.improve(setting, &tried, spending)?;
            let present = self.current.fit.log_likelihood;
            let best = tried.first().map_or(0.0, |(_, best)| best.fit.log_likelihood - present);
            if present - before < SCREENINGS.1.max(SCREENINGS.2 * best) {
                break;
            }
        }
        if self.current.causes.is_empty() {
            self.bare = self.current.fit.log_likelihood;
        }
        if self.ladder.is_empty() {
            self.untried = dropped;
        }
        self.untried.retain(|(cause, _)| tried.iter().all(|(other, _)| other != cause));
        self.short_list = spending.short_list;
        // The best model's innovations say how correlated they are when what can be explained is.
        self.inflation = match tried.first_mut() {
            Some((_, best)) => best.inflation(setting)?,
            None => self.current.inflation(setting)?,
        };
        Ok(tried)
    }

    /// The second half: the likeliest are judged, and one of them may be found worth adopting. The present model is the best without it
    /// then.
    ///
    /// # Errors
    /// As [`FittedModel::cross_fit`].
    pub fn judge(
        &mut self,
        setting: &Context<'_>,
        number: usize,
        mut tried: Vec<ScreenedCause>,
        spending: &SearchBudget,
    ) -> Result<Judged, DiagnoseError> {
        let present = self.current.fit.log_likelihood;
        let gain = |candidate: &FittedModel| candidate.fit.log_likelihood - present;
        let short_list = self.short_list;
        let listed = |i: usize, cause: &Extension| i < short_list || cause.family() == PHASE;
        let left = tried.first().map_or(&self.current, |(_, best)| best).fit.point.noise;
        let residue = residue(&self.current.causes, self.explained());
        self.need = need(setting, self.inflation, &self.current.fit.point.noise, &left, residue);
        self.margin = margin(self.inflation, left, self.need);
        let hopeful: Vec<bool> = tried
            .iter()
            .enumerate()
            .map(|(i, (cause, c))| listed(i, cause) && is_hopeful(gain(c), self.need))
            .collect();
        let held: Result<Vec<Option<CrossValidated>>, DiagnoseError> = tried
            .par_iter_mut()
            .zip(&hopeful)
            .map(|((_, candidate), hopeful)| if *hopeful { candidate.cross_fit(setting).map(Some) } else { Ok(None) })
            .collect();
        let mut held = held?;
        let ladder = self.ladder.len();
        let mut adopted = self.choose(setting, number, &tried, &held)?;
        if adopted.is_none() && self.anew(setting, spending, &mut tried, &mut held)? {
            self.ladder.truncate(ladder);
            adopted = self.choose(setting, number, &tried, &held)?;
        }
        self.note_untestable(&tried);
        let on_trial = if adopted.is_none() { self.worth_a_trial(&tried) } else { None };
        Ok(Judged { tried, held, adopted, on_trial, ladder })
    }

    /// Adopts what was found worth it; true if there was anything.
    pub fn adopt(&mut self, judged: Judged) -> bool {
        let Judged { tried, held, adopted, on_trial, ladder } = judged;
        let Some(adopted) = adopted.or(on_trial) else { return false };
        let evidence = self.evidence.clone();
        let (before, held) = self.take(adopted, tried, held, ladder);
        if on_trial.is_some() {
            self.begin_trial(before, held, evidence, ladder);
        }
        true
    }

    /// The causes that the present model may have besides: none that it has, no second one of the phase family, and none that was lost
    /// when just these were before it.
    fn to_try(&self, causes: &[&'static Extension]) -> Vec<&'static Extension> {
        let present = &self.current.causes;
        let phase = present.iter().any(|cause| cause.family() == PHASE);
        let lost = |cause| self.lost.iter().any(|(lost, before)| *lost == cause && before == present);
        let may =
            |cause: &&'static Extension| !(present.contains(cause) || phase && cause.family() == PHASE || lost(*cause));
        causes.iter().copied().filter(may).collect()
    }

    /// Where a cause was found beside a base that lacks it, the base may lie on a bound that the two together need not touch, and which
    /// no derivative leaves: the present model once more from where that parameter is held elsewhere.
    fn off_its_bounds(&mut self, setting: &Context<'_>, spending: &SearchBudget) -> Result<(), DiagnoseError> {
        if self.current.causes.is_empty() {
            return Ok(());
        }
        let starts = within_bounds(setting, &self.current)?;
        if starts.is_empty() {
            return Ok(());
        }
        let plan = Plan { select: starts.len(), kinds: 1, rough: 2, keep: starts.len(), ..spending.plan };
        self.again_from(setting, &starts, plan)
    }

    /// Refits the present model from where the causes took it: a gain must not be due to a better fit of the rest.
    pub(crate) fn improve(
        &mut self,
        setting: &Context<'_>,
        tried: &[ScreenedCause],
        spending: &SearchBudget,
    ) -> Result<(), DiagnoseError> {
        let from = |candidate: &FittedModel| Point {
            values: self.current.model.adopt(&candidate.model, &candidate.fit.point.values),
            noise: candidate.fit.point.noise,
        };
        let free = self.current.fit.point.noise;
        let free = free.freer();
        let mut starts: Vec<Point> = tried.iter().take(3).map(|(_, candidate)| from(candidate)).collect();
        starts.push(Point { noise: free, ..self.current.fit.point.clone() });
        let plan =
            Plan { select: 4, kinds: 1, rough: 4, keep: 2, fine: spending.plan.fine, tolerance: 0.1, least: [0.0; 2] };
        self.again_from(setting, &starts, plan)
    }

    /// The present model fitted from some starts, if that is likelier.
    fn again_from(&mut self, setting: &Context<'_>, starts: &[Point], plan: Plan) -> Result<(), DiagnoseError> {
        let model = setting.model(self.current.variant, &self.current.model.events)?;
        let again = FittedModel::fitted(setting, self.current.variant, &self.current.causes, model, starts, plan)?;
        let rugged = self.current.causes.iter().any(|cause| is_rugged(cause));
        let again = match again {
            Some(again) if rugged => Some(polished(setting, again, plan)?),
            again => again,
        };
        if let Some(again) = again
            && again.fit.log_likelihood > self.current.fit.log_likelihood + 0.5
        {
            self.current = again;
            self.held = self.current.cross_fit(setting)?;
        }
        Ok(())
    }

    fn note_untestable(&mut self, tried: &[ScreenedCause]) {
        if !self.not_testable.is_empty() || !self.current.causes.is_empty() {
            return;
        }
        for (cause, candidate) in tried {
            let (index, absorbed_by) = identifiability(candidate, cause);
            let gain = candidate.fit.log_likelihood - self.current.fit.log_likelihood;
            if index < ABSORBED && (gain < self.need || cause.family() == "absorbed") {
                self.not_testable.push(NotTestable { name: cause.name.clone(), absorbed_by });
            }
        }
    }

    /// Adopts; returns the model before, with its held-out likelihood. `ladder` is the first row of this round, whose rows are in the
    /// order of `tried`: what was as likely as a cause of an earlier round is no rival of this one.
    fn take(
        &mut self,
        chosen: usize,
        tried: Vec<ScreenedCause>,
        held: Vec<Option<CrossValidated>>,
        ladder: usize,
    ) -> (FittedModel, CrossValidated) {
        let rows = &self.ladder[ladder..];
        let of = tried[chosen].0;
        self.evidence.push((rows[chosen].evidence, self.need));
        let (mut rivals, mut before) = (Vec::new(), None);
        for (i, ((cause, candidate), held)) in tried.into_iter().zip(held).enumerate() {
            if i == chosen {
                let held = held.expect("an adopted cause was cross-fitted");
                before =
                    Some((std::mem::replace(&mut self.current, candidate), std::mem::replace(&mut self.held, held)));
            } else if matches!(rows[i].fate, Fate::AsLikely { .. }) {
                rivals.push(Rival { of, cause, candidate, evidence: rows[i].evidence, need: self.need });
            }
        }
        self.rivals.append(&mut rivals);
        before.expect("the chosen one is among those tried")
    }
}

#[cfg(test)]
mod tests;
