//! Whether a cause counts as found: what is asked of it, in this order, up to the first check that is not met.

pub mod evidence;
pub mod fate;
pub mod holdout;
pub mod oracle;

use self::evidence::Evidence;
use self::fate::{Objection, Size};
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

/// What is asked of a cause.
#[derive(Debug)]
pub struct Judgement<'a> {
    /// The cause.
    pub cause: &'static Extension,
    /// What it gains.
    pub evidence: Evidence,
    /// Everything that was asked, in this order; only the last check may be unmet.
    pub checks: Vec<Check>,
    /// What speaks against it, if anything does.
    pub objection: Option<Objection>,
    models: [&'a FittedModel; 2],
}

impl<'a> Judgement<'a> {
    /// Judges a model with a cause against one without, by what is known without another run. The evidence has to exceed `need` \[nats\].
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
        judgement.ask(Check::above("evidence", counts, need), || Objection::Weak { evidence: counts, need });
        // What acts in one stretch only happens in one fold.
        if local.is_none() {
            judgement.ask(Check::above("evidence of the weaker fold", first.min(second), 0.0), || Objection::OneFold);
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

    fn ask(&mut self, check: Check, objection: impl FnOnce() -> Objection) {
        if self.passes() {
            self.objection = (!check.met).then(objection);
            self.checks.push(check);
        }
    }

    /// Whether the sizes of the cause are such that it can be a name.
    fn ask_sizes(&mut self, model: &FittedModel) {
        let value = |k: usize| model.fit.point.values[k];
        let symbol = |k: usize| model.model.symbols[k];
        let sized = |k: &usize| symbol(*k).neutral().is_some();
        let sizes: Vec<usize> = model.model.positions(self.cause).into_iter().filter(sized).collect();
        let size =
            |k: usize| Size { name: symbol(k).name().to_owned(), value: value(k), unit: symbol(k).unit().to_owned() };
        let idle = |k: usize| symbol(k).neutral().is_none_or(|none| model.model.axes[k].same(value(k), none));
        // As a whole it does nothing, so what gains is something else that was fitted again.
        let all_idle = sizes.iter().all(|&k| idle(k));
        let positive = self.cause.cause.as_ref().is_some_and(|traits| traits.positive);
        for k in sizes {
            if positive {
                self.ask(Check::at_least(symbol(k).name(), value(k), 0.0), || Objection::WrongSign(size(k)));
            }
            let axis = model.model.axes[k];
            // One of several sizes may be none.
            if !axis.is_fixed() && (all_idle || !idle(k)) {
                let name = format!("share of the range between {} and its bounds", symbol(k).name());
                let check = Check::at_least(&name, axis.from_bound(value(k)), POLICY.same);
                self.ask(check, || Objection::OnBound(size(k)));
            }
        }
    }

    /// Whether a calibration makes up for most of its effect.
    fn ask_identifiability(&mut self, model: &FittedModel) {
        if self.passes() && self.cause.family() == ABSORBED {
            let (share, by) = identifiability(model, self.cause);
            let name = "share of its effect that no other parameter has";
            self.ask(Check::at_least(name, share, POLICY.absorbed), || Objection::Absorbed { by });
        }
    }

    /// Whether it also gains on the hold-out, if nothing speaks against it so far. Events need not recur there, nor must it reach what a
    /// cause changes. `alone` as in [`transfers`].
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
            self.ask(Check::at_least(name, share, POLICY.transfers), || Objection::NoTransfer { share });
        }
        Ok(())
    }
}

/// The family of causes that a calibration may make up for.
pub const ABSORBED: &str = "absorbed";

#[cfg(test)]
mod tests;
