//! Rounds: each tries every cause on the present model, cross-fits and judges the likeliest, and adopts one of them.

mod choice;

use crate::diagnose::judge::ABSORBED;
use crate::diagnose::judge::decision::{Decision, Rejection};
use crate::diagnose::judge::evidence::{is_hopeful, need};
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

/// Largest number of rounds.
pub const ROUNDS: usize = 5;

/// A cause that could replace an adopted one, fitted in its place.
#[derive(Debug)]
pub struct Rival {
    /// The cause that it could replace.
    pub of: &'static Extension,
    /// The rival.
    pub cause: &'static Extension,
    /// The model with the rival.
    pub candidate: FittedModel,
    /// Its evidence \[nats\].
    pub evidence: f64,
    /// The threshold \[nats\].
    pub need: f64,
}

/// The state of the search.
#[derive(Debug)]
pub struct State {
    /// The present model.
    pub current: FittedModel,
    /// Its held-out likelihood.
    pub held: CrossValidated,
    /// Log-likelihood of the base without causes \[nats\].
    pub(crate) bare: f64,
    /// Evidence and threshold of each adopted cause, in the order of the model's causes.
    pub evidence: Vec<(f64, f64)>,
    /// Causes that could have replaced an adopted one in its round.
    pub(crate) rivals: Vec<Rival>,
    /// All causes that were tried.
    pub ladder: Vec<Tried>,
    /// Causes that a check rejected in the last round or at the end, with their evidence and the threshold \[nats\].
    pub stopped: Vec<(&'static Extension, f64, f64, Rejection)>,
    /// Causes that the data cannot show.
    pub not_testable: Vec<NotTestable>,
    /// Causes that could not be tried on the base or in a later round.
    pub untried: Vec<Skipped>,
    /// Threshold of the last round \[nats\].
    pub need: f64,
    /// Inflation of the last round.
    pub inflation: f64,
    /// True if the simulation limit ended the rounds, and not a round without a result.
    pub(crate) cut_short: bool,
}

/// The result of a round.
#[derive(Debug)]
pub struct Judged {
    /// All causes that were tried, and the held-out likelihood of those that were cross-fitted.
    tried: Vec<ScreenedCause>,
    held: Vec<Option<CrossValidated>>,
    /// Position of the adopted cause.
    adopted: Option<usize>,
    /// First row of the round in the ladder.
    ladder: usize,
}

/// The missing acceleration of a candidate on every drive \[m/s²\], under a rather strong observer.
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
    /// The state before the first round.
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

    /// Joint evidence of the adopted causes \[nats\]: the sum, at most the gain over the base. If causes hide each other, removing any of
    /// them costs nearly the whole gain.
    #[must_use]
    pub fn explained(&self) -> f64 {
        let sum: f64 = self.evidence.iter().map(|(evidence, _)| evidence.max(0.0)).sum();
        sum.min((self.current.fit.log_likelihood - self.bare).max(0.0))
    }

    /// Causes that could replace an adopted one. A cause that was adopted in a later round is no longer a rival, and neither are its
    /// relatives.
    pub fn rivals(&self) -> impl Iterator<Item = &Rival> {
        let kin = |cause: &&Extension, rival: &Rival| *cause != rival.of && cause.family() == rival.cause.family();
        self.rivals.iter().filter(move |rival| !self.current.causes.iter().any(|cause| kin(cause, rival)))
    }

    /// True if no further round begins after this number of simulations: with two causes, the search continues only below the limit.
    pub(crate) fn has_enough(&self, simulated: u64, spending: &SearchBudget) -> bool {
        self.current.causes.len() > 1 && simulated > spending.enough
    }

    /// The first half of a round: fits every further cause, sorted by likelihood, and refits the present model from the parameters of the
    /// best.
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
        // The innovations of the best model give the correlation without the effects that can be explained.
        self.inflation = match tried.first_mut() {
            Some((_, best)) => best.inflation(setting)?,
            None => self.current.inflation(setting)?,
        };
        Ok(tried)
    }

    /// The second half: judges the likeliest causes and selects at most one to adopt.
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

    /// Adopts the selected cause; false without one.
    pub fn adopt(&mut self, judged: Judged) -> bool {
        let Judged { tried, held, adopted, ladder } = judged;
        if let Some(adopted) = adopted {
            self.take(adopted, tried, held, ladder);
        }
        adopted.is_some()
    }

    /// The causes that the present model may still get: at most one of a family.
    fn to_try(&self, causes: &[&'static Extension]) -> Vec<&'static Extension> {
        let has = |family: &str| self.current.causes.iter().any(|cause| cause.family() == family);
        causes.iter().copied().filter(|cause| !has(cause.family())).collect()
    }

    /// Refits the present model from the parameters of the causes: a gain must not come from a better fit of the rest.
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

    /// Adopts a cause. `ladder` is the first row of this round; its rows are in the order of `tried`. A rival of a cause from an earlier
    /// round is not a rival of this one.
    fn take(&mut self, chosen: usize, tried: Vec<ScreenedCause>, held: Vec<Option<CrossValidated>>, ladder: usize) {
        let rows = &self.ladder[ladder..];
        let of = tried[chosen].0;
        self.evidence.push((rows[chosen].evidence, self.need));
        let mut rivals = Vec::new();
        for (i, ((cause, candidate), held)) in tried.into_iter().zip(held).enumerate() {
            if i == chosen {
                self.current = candidate;
                self.held = held.expect("an adopted cause was cross-fitted");
            } else if matches!(rows[i].fate, Decision::AsLikely { .. }) {
                rivals.push(Rival { of, cause, candidate, evidence: rows[i].evidence, need: self.need });
            }
        }
        self.rivals.append(&mut rivals);
    }
}

#[cfg(test)]
mod tests;
