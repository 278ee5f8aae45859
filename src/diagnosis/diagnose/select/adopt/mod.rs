//! Rounds: every cause is tried on the present model, the likeliest are cross-fitted and judged, and one of them is adopted.

mod choice;

use crate::diagnose::judge::ABSORBED;
use crate::diagnose::judge::evidence::{is_hopeful, need};
use crate::diagnose::judge::fate::{Fate, Objection};
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::outcome::{NotTestable, Tried};
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, CrossValidated, FittedModel};
use crate::diagnose::search::screen::{ScreenedCause, identifiability, screen};
use crate::diagnose::search::search_budget::SearchBudget;
use crate::diagnose::search::skipped::Skipped;
use crate::extension::Extension;
use rayon::prelude::*;

/// Rounds at most.
pub const ROUNDS: usize = 5;

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
pub struct State {
    /// The model as far as it is extended.
    pub current: FittedModel,
    /// Its held-out likelihood.
    pub held: CrossValidated,
    /// Log-likelihood of the base without causes \[nats\].
    pub(crate) bare: f64,
    /// Evidence and threshold of each adopted cause, in the order of the model's causes.
    pub evidence: Vec<(f64, f64)>,
    /// Causes that could be in the place of an adopted one when it was.
    pub(crate) rivals: Vec<Rival>,
    /// Everything tried.
    pub ladder: Vec<Tried>,
    /// Causes that something spoke against in the last round or at the end, with their evidence and the threshold \[nats\].
    pub stopped: Vec<(&'static Extension, f64, f64, Objection)>,
    /// Causes that the data cannot show.
    pub not_testable: Vec<NotTestable>,
    /// Causes that could not be tried on the base, nor in a later round.
    pub untried: Vec<Skipped>,
    /// Threshold of the last round \[nats\].
    pub need: f64,
    /// Inflation of the last round.
    pub inflation: f64,
    /// True if rounds ended because enough was simulated, and not because nothing more was found.
    pub(crate) cut_short: bool,
}

/// What a round has found.
#[derive(Debug)]
pub struct Judged {
    /// Everything tried, and the held-out likelihood of what was worth a cross-fit.
    tried: Vec<ScreenedCause>,
    held: Vec<Option<CrossValidated>>,
    /// Position of what is adopted.
    adopted: Option<usize>,
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

impl State {
    /// The search before any round.
    ///
    /// # Errors
    /// As [`FittedModel::cross_fit`].
    pub fn begin(setting: &Context<'_>, base: FittedModel) -> Result<State, DiagnoseError> {
        let held = base.cross_fit(setting)?;
        let inflation = base.inflation(setting)?;
        Ok(State {
            bare: base.fit.log_likelihood,
            current: base,
            held,
            evidence: Vec::new(),
            rivals: Vec::new(),
            ladder: Vec::new(),
            stopped: Vec::new(),
            not_testable: Vec::new(),
            untried: Vec::new(),
            need: 0.0,
            inflation,
            cut_short: false,
        })
    }

    /// What the adopted causes explain together \[nats\]: the sum of their evidence, but not more than the gain of the whole over the
    /// base. Of causes that hide each other each one's removal costs nearly everything.
    #[must_use]
    pub fn explained(&self) -> f64 {
        let sum: f64 = self.evidence.iter().map(|(evidence, _)| evidence.max(0.0)).sum();
        sum.min((self.current.fit.log_likelihood - self.bare).max(0.0))
    }

    /// Causes that could be in the place of an adopted one. One that was found as well, in a later round, is none any more, nor is its kin.
    pub fn rivals(&self) -> impl Iterator<Item = &Rival> {
        let kin = |cause: &&Extension, rival: &Rival| *cause != rival.of && cause.family() == rival.cause.family();
        self.rivals.iter().filter(move |rival| !self.current.causes.iter().any(|cause| kin(cause, rival)))
    }

    /// True if nothing more is to be looked for after so many simulations: beside two causes the search goes on only while there is room.
    pub(crate) fn has_enough(&self, simulated: u64, spending: &SearchBudget) -> bool {
        self.current.causes.len() > 1 && simulated > spending.enough
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
        let missing = missing(&self.current)?;
        let (mut tried, dropped) = screen(setting, &self.current, &causes, &missing, spending)?;
        tried.sort_by(|a, b| b.1.fit.log_likelihood.total_cmp(&a.1.fit.log_likelihood));
        self.improve(setting, &tried, spending)?;
        if self.current.causes.is_empty() {
            self.bare = self.current.fit.log_likelihood;
        }
        if self.ladder.is_empty() {
            self.untried = dropped;
        }
        self.untried.retain(|(cause, _)| tried.iter().all(|(other, _)| other != cause));
        // The best model's innovations say how correlated they are when what can be explained is.
        self.inflation = match tried.first_mut() {
            Some((_, best)) => best.inflation(setting)?,
            None => self.current.inflation(setting)?,
        };
        Ok(tried)
    }

    /// The second half: the likeliest are judged, and one of them may be found worth adopting.
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
        let left = tried.first().map_or(&self.current, |(_, best)| best);
        let noises = [&self.current.fit.point.noise, &left.fit.point.noise];
        self.need = need(setting, self.inflation, noises, self.explained());
        let need = self.need;
        let held: Result<Vec<Option<CrossValidated>>, DiagnoseError> = tried
            .par_iter_mut()
            .enumerate()
            .map(|(i, (_, candidate))| {
                let hopeful = i < spending.short_list && is_hopeful(candidate.fit.log_likelihood - present, need);
                hopeful.then(|| candidate.cross_fit(setting)).transpose()
            })
            .collect();
        let held = held?;
        let ladder = self.ladder.len();
        let adopted = self.choose(setting, number, &tried, &held, spending)?;
        self.note_untestable(&tried);
        Ok(Judged { tried, held, adopted, ladder })
    }

    /// Adopts what was found worth it; true if there was anything.
    pub fn adopt(&mut self, judged: Judged) -> bool {
        let Judged { tried, held, adopted, ladder } = judged;
        if let Some(adopted) = adopted {
            self.take(adopted, tried, held, ladder);
        }
        adopted.is_some()
    }

    /// The causes that the present model may have besides: one of a family at most.
    fn to_try(&self, causes: &[&'static Extension]) -> Vec<&'static Extension> {
        let has = |family: &str| self.current.causes.iter().any(|cause| cause.family() == family);
        causes.iter().copied().filter(|cause| !has(cause.family())).collect()
    }

    /// Refits the present model from where the causes took it: a gain must not be due to a better fit of the rest.
    fn improve(
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
        let plan = Plan { select: 4, rough: 4, keep: 2, fine: spending.plan.fine, tolerance: 0.1, least: [0.0; 2] };
        let model = setting.model(self.current.variant, &self.current.model.events)?;
        let again = FittedModel::fitted(setting, self.current.variant, &self.current.causes, model, &starts, plan)?;
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
            if index < POLICY.absorbed && (gain < self.need || cause.family() == ABSORBED) {
                self.not_testable.push(NotTestable { name: cause.name.clone(), absorbed_by });
            }
        }
    }

    /// Adopts. `ladder` is the first row of this round, whose rows are in the
    /// order of `tried`: what was as likely as a cause of an earlier round is no rival of this one.
    fn take(&mut self, chosen: usize, tried: Vec<ScreenedCause>, held: Vec<Option<CrossValidated>>, ladder: usize) {
        let rows = &self.ladder[ladder..];
        let of = tried[chosen].0;
        self.evidence.push((rows[chosen].evidence, self.need));
        let mut rivals = Vec::new();
        for (i, ((cause, candidate), held)) in tried.into_iter().zip(held).enumerate() {
            if i == chosen {
                self.current = candidate;
                self.held = held.expect("an adopted cause was cross-fitted");
            } else if matches!(rows[i].fate, Fate::AsLikely { .. }) {
                rivals.push(Rival { of, cause, candidate, evidence: rows[i].evidence, need: self.need });
            }
        }
        self.rivals.append(&mut rivals);
    }
}

#[cfg(test)]
mod tests;
