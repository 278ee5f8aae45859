//! Decides whether a cause counts as found: checks in this order, up to the first that fails.

pub mod decision;
pub mod evidence;
pub mod holdout;
pub mod oracle;

use self::decision::{Rejection, Size};
use self::evidence::Evidence;
use self::holdout::transfers;
use super::policy::POLICY;
use super::question::DiagnoseError;
use super::search::fitted_model::{Context, CrossValidated, FittedModel, Transferred};
use super::search::screen::identifiability;
use crate::extension::Extension;
use crate::judge::Check;
use crate::symbols::SearchKind;

/// A model and its held-out likelihood.
pub type Validated<'a> = (&'a FittedModel, &'a CrossValidated);

/// The checks of a cause.
#[derive(Debug)]
pub struct Judgement<'a> {
    /// The cause.
    pub cause: &'static Extension,
    /// Its gain.
    pub evidence: Evidence,
    /// All checks in this order; only the last one may have failed.
    pub checks: Vec<Check>,
    /// The objection, if a check failed.
    pub objection: Option<Rejection>,
    models: [&'a FittedModel; 2],
}

impl<'a> Judgement<'a> {
    /// Judges a model with a cause against one without, as far as no further run is needed. The evidence has to exceed `need` \[nats\].
    #[must_use]
    pub fn of(
        setting: &Context<'_>,
        cause: &'static Extension,
        with: Validated<'a>,
        without: Validated<'a>,
        need: f64,
    ) -> Judgement<'a> {
        let evidence = Evidence::of(setting, cause, with, without);
        let (counts, [first, second], local) = (evidence.counts(), evidence.folds, evidence.local);
        let mut judgement =
            Judgement { cause, evidence, checks: Vec::new(), objection: None, models: [with.0, without.0] };
        judgement.ask(Check::above("evidence", counts, need), || Rejection::Weak { evidence: counts, need });
        // A cause that acts in one stretch only may lie in one fold.
        if local.is_none() {
            judgement.ask(Check::above("evidence of the weaker fold", first.min(second), 0.0), || Rejection::OneFold);
        }
        judgement.ask_sizes(with.0);
        judgement.ask_identifiability(with.0);
        judgement
    }

    /// True if every check is met.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.objection.is_none()
    }

    fn ask(&mut self, check: Check, objection: impl FnOnce() -> Rejection) {
        if self.passes() {
            self.objection = (!check.met).then(objection);
            self.checks.push(check);
        }
    }

    /// Checks that the sizes of the cause allow a name.
    fn ask_sizes(&mut self, model: &FittedModel) {
        let value = |k: usize| model.fit.point.values[k];
        let symbol = |k: usize| model.model.symbols[k];
        let sized = |k: &usize| symbol(*k).neutral().is_some();
        let sizes: Vec<usize> = model.model.positions(self.cause).into_iter().filter(sized).collect();
        let size =
            |k: usize| Size { name: symbol(k).name().to_owned(), value: value(k), unit: symbol(k).unit().to_owned() };
        let idle = |k: usize| symbol(k).neutral().is_none_or(|none| model.model.axes[k].same(value(k), none));
        // The cause as a whole does nothing, so the gain comes from the refit of other parameters.
        let all_idle = sizes.iter().all(|&k| idle(k));
        let positive = self.cause.cause.as_ref().is_some_and(|traits| traits.positive);
        for k in sizes {
            if positive {
                self.ask(Check::at_least(symbol(k).name(), value(k), 0.0), || Rejection::WrongSign(size(k)));
            }
            let axis = model.model.axes[k];
            // One of several sizes may be zero.
            if !axis.is_fixed() && (all_idle || !idle(k)) {
                let name = format!("share of the range between {} and its bounds", symbol(k).name());
                let check = Check::at_least(&name, axis.from_bound(value(k)), POLICY.same);
                self.ask(check, || Rejection::OnBound(size(k)));
            }
        }
    }

    /// Checks that other parameters do not absorb most of its effect.
    fn ask_identifiability(&mut self, model: &FittedModel) {
        if self.passes() && self.cause.family() == ABSORBED {
            let (share, by) = identifiability(model, self.cause);
            let name = "share of its effect that other parameters cannot absorb";
            self.ask(Check::at_least(name, share, POLICY.absorbed), || Rejection::Absorbed { by });
        }
    }

    /// Checks that it also gains on the hold-out, if no check has failed so far. Events need not recur there, and the hold-out need not
    /// reach the states that a cause changes. `alone` as in [`transfers`].
    ///
    /// # Errors
    /// As [`transfers`].
    pub fn ask_holdout(&mut self, setting: &Context<'_>, alone: &mut Option<Transferred>) -> Result<(), DiagnoseError> {
        let recurs = !matches!(self.cause.search(), SearchKind::Event | SearchKind::Stretch);
        if !self.passes() || !recurs || setting.question.holdout.is_empty() {
            return Ok(());
        }
        let [with, without] = self.models;
        let (share, changed) = transfers(setting, with, self.cause, without, alone)?;
        if changed >= POLICY.shown {
            let name = "share of the bootstraps of the hold-out in which it gains";
            self.ask(Check::at_least(name, share, POLICY.transfers), || Rejection::NoTransfer { share });
        }
        Ok(())
    }
}

/// The family of causes that a calibration may absorb.
pub const ABSORBED: &str = "absorbed";

#[cfg(test)]
mod tests;
