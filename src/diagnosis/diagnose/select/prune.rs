//! Drops causes that later ones made superfluous.

use super::adopt::State;
use crate::catalog::Variant;
use crate::diagnose::judge::Judgement;
use crate::diagnose::judge::decision::Decision;
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, FittedModel};
use crate::diagnose::search::search_budget::SearchBudget;
use crate::extension::Extension;

impl State {
    /// Drops every cause that would not be adopted beside the others: a later one may explain its effect, or may have moved it to a bound.
    /// After each removal it checks all others again.
    ///
    /// # Errors
    /// As [`FittedModel::fitted`].
    pub fn prune(&mut self, setting: &Context<'_>, spending: &SearchBudget) -> Result<(), DiagnoseError> {
        if self.current.causes.len() == 1 {
            // Adoption has already compared it with the base.
            return Ok(());
        }
        let mut place = 0;
        while place < self.current.causes.len() {
            let cause = self.current.causes[place];
            let Some(reduced) = without(&self.current, setting, cause, spending)? else {
                place += 1;
                continue;
            };
            let held = reduced.cross_fit(setting)?;
            let (with, need) = ((&self.current, &self.held), self.evidence[place].1);
            let Judgement { evidence, objection, .. } = Judgement::of(setting, cause, with, (&reduced, &held), need);
            let evidence = evidence.counts();
            let Some(objection) = objection else {
                self.evidence[place].0 = evidence;
                place += 1;
                continue;
            };
            self.current = reduced;
            self.held = held;
            self.evidence.remove(place);
            self.rivals.retain(|rival| rival.of != cause);
            for row in self.ladder.iter_mut().filter(|row| row.fate.is_adopted() && row.name == cause.name) {
                row.fate = Decision::Dropped(objection.clone());
            }
            self.stopped.push((cause, evidence, need, objection));
            // The removal changes the evidence of all others.
            place = 0;
        }
        Ok(())
    }
}

/// A model without one of its causes, refitted.
fn without(
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
    let plan =
        Plan { select: starts.len(), rough: 5, keep: 1, fine: spending.base.fine, tolerance: 0.1, least: [0.0; 2] };
    FittedModel::fitted(setting, variant, &causes, model, &starts, plan)
}
