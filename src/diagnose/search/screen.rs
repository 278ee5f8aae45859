//! Every cause tried on top of a model: fitted with its own noise from many starts.

use super::fitted_model::{Context, FittedModel};
use super::profile_grid::{from_held, set_free};
use super::scope::{Scope, scopes};
use super::search_budget::SearchBudget;
use super::skipped::{Skipped, Untried};
use super::start::{FOR_AN_EVENT, FOR_STEPS, KINDS, softened_by};
use crate::catalog::Variant;
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::likelihood::model::{LEAD, is_rugged};
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::question::DiagnoseError;
use crate::extension::Extension;
use crate::symbols::SearchKind;
use crate::wgsl::extension_named;
use rayon::prelude::*;

/// A cause, and the present model with it.
pub type ScreenedCause = (&'static Extension, FittedModel);

/// The model with one cause more, fitted; the best of several drives in which an event may happen.
///
/// # Errors
/// As [`FittedModel::fitted`].
pub fn explain(
    setting: &Context<'_>,
    current: &FittedModel,
    cause: &'static Extension,
    missing: &[Vec<f64>],
    spending: &SearchBudget,
) -> Result<Result<FittedModel, Untried>, DiagnoseError> {
    let variant = match current.variant.with(cause) {
        Ok(variant) => variant,
        Err(conflict) => return Ok(Err(Untried::Conflict(conflict))),
    };
    let causes: Vec<&'static Extension> = current.causes.iter().copied().chain([cause]).collect();
    let mut best: Option<FittedModel> = None;
    let scopes = match scopes(setting, current, variant, cause, missing, spending)? {
        Ok(scopes) => scopes,
        Err(untried) => return Ok(Err(untried)),
    };
    let without_start = scopes.iter().all(|scope| scope.starts.is_empty());
    for mut scope in scopes {
        if let Some(best) = best.as_ref().filter(|_| !scope.usual) {
            // What happens in one drive may happen in all of them.
            let values = scope.model.adopt(&best.model, &best.fit.point.values);
            let noises = [best.fit.point.noise, current.fit.point.noise];
            scope.starts.extend(noises.map(|noise| Point { values: values.clone(), noise }));
        }
        let held = if scope.usual { Vec::new() } else { from_held(setting, current, &scope.model, cause)? };
        let Some(found) = searched(setting, current, variant, &causes, scope, spending)? else { continue };
        let found = set_free(setting, found, &held, spending)?;
        if best.as_ref().is_none_or(|best| found.fit.log_likelihood > best.fit.log_likelihood) {
            best = Some(found);
        }
    }
    Ok(best.ok_or_else(|| if without_start { no_start(cause) } else { Untried::NotFinite }))
}

fn no_start(cause: &Extension) -> Untried {
    let open = cause.parameters.iter().filter(|symbol| symbol.neutral().is_none());
    Untried::NoStart { parameters: open.map(|symbol| symbol.name().to_owned()).collect() }
}

/// The best fit from the starts of a scope, and from where they lead on a smoother likelihood, if there is one (see [`softened`]).
fn searched(
    setting: &Context<'_>,
    current: &FittedModel,
    variant: Variant,
    causes: &[&'static Extension],
    scope: Scope,
    spending: &SearchBudget,
) -> Result<Option<FittedModel>, DiagnoseError> {
    let Scope { model, mut starts, kinds, event, .. } = scope;
    let mut plan = Plan { kinds, ..spending.plan };
    if event {
        // Under several observers they do not compare: all are followed.
        plan = Plan { select: starts.len(), keep: plan.keep.max(KINDS), ..plan };
    } else if causes.last().is_some_and(|cause| cause.search() == SearchKind::Integral) {
        plan.select = plan.select.min(3);
    }
    let fitted = |model, starts: &[Point], plan| FittedModel::fitted(setting, variant, causes, model, starts, plan);
    let noise = current.fit.point.noise;
    let factor = if event {
        FOR_AN_EVENT
    } else if causes.last().is_some_and(|cause| is_rugged(cause)) {
        FOR_STEPS
    } else {
        1.0
    };
    let Some(soft) = softened_by(&noise, factor) else { return fitted(model, &starts, plan) };
    // Only where it leads matters.
    let smoother = Plan { least: [soft.r_s, soft.r_v], fine: plan.fine.div_ceil(2), ..plan };
    let Some(FittedModel { model, fit, .. }) = fitted(model, &starts, smoother)? else { return Ok(None) };
    let found = Noise { r_s: noise.r_s, r_v: noise.r_v, ..fit.point.noise };
    let free = noise.freer();
    starts.extend([noise, free, found].map(|noise| Point { values: fit.point.values.clone(), noise }));
    if !event {
        // What was worth a search is found from there.
        plan.select = plan.select.div_ceil(2);
    }
    // One of these may begin below the others and end above them.
    plan.select += KINDS.div_ceil(plan.kinds);
    plan.keep = plan.keep.max(KINDS);
    fitted(model, &starts, plan)
}

/// How long a cause takes to try, next to others: times have to be scanned, and jumps to be searched without derivatives.
fn takes(cause: &Extension) -> usize {
    let times = cause.parameters.iter().filter(|symbol| symbol.is_time()).count();
    2 * times + usize::from(is_rugged(cause))
}

/// All causes tried on top of a model: those that run, and those that could not be tried; both in the order given.
///
/// # Errors
/// As [`explain`].
pub fn screen(
    setting: &Context<'_>,
    current: &FittedModel,
    causes: &[&'static Extension],
    missing: &[Vec<f64>],
    spending: &SearchBudget,
) -> Result<(Vec<ScreenedCause>, Vec<Skipped>), DiagnoseError> {
    // What takes longest comes first, so that nobody waits for it in the end.
    let mut order: Vec<usize> = (0..causes.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(takes(causes[i])));
    let explained = |i: usize| Ok((i, explain(setting, current, causes[i], missing, spending)?));
    let all: Result<Vec<_>, DiagnoseError> = order.into_iter().par_bridge().map(explained).collect();
    let mut all = all?;
    all.sort_unstable_by_key(|(i, _)| *i);
    let (mut tried, mut dropped) = (Vec::new(), Vec::new());
    for (cause, found) in all.into_iter().map(|(i, found)| (causes[i], found)) {
        match found {
            Ok(found) => tried.push((cause, found)),
            Err(untried) => dropped.push((cause, untried)),
        }
    }
    Ok((tried, dropped))
}

/// Share of a cause's effect that the other parameters cannot absorb, and those that absorb most of it.
#[must_use]
pub fn identifiability(candidate: &FittedModel, cause: &'static Extension) -> (f64, Vec<String>) {
    let information = &candidate.fit.information;
    let positions = candidate.model.positions(cause);
    let Some(&k) = positions.iter().find(|&&k| candidate.model.symbols[k].neutral().is_some()) else {
        return (1.0, Vec::new());
    };
    if information.nrows() <= k || information[(k, k)] <= 0.0 {
        // It does nothing at all here, so nothing can absorb it.
        return (1.0, Vec::new());
    }
    // The nuisance lead reaches a twentieth of a second and can absorb nothing larger, whatever its derivative says.
    let lead = extension_named(LEAD).map_or_else(Vec::new, |lead| candidate.model.positions(lead));
    let others: Vec<usize> = (0..candidate.model.axes.len())
        .filter(|j| !positions.contains(j) && !lead.contains(j))
        .filter(|j| information[(*j, *j)] > 1e-9 && !candidate.model.axes[*j].is_fixed())
        .collect();
    let scale = |j: usize| information[(j, j)].sqrt();
    let matrix = nalgebra::DMatrix::from_fn(others.len(), others.len(), |a, b| {
        information[(others[a], others[b])] / (scale(others[a]) * scale(others[b])) + if a == b { 1e-9 } else { 0.0 }
    });
    let right =
        nalgebra::DVector::from_fn(others.len(), |a, _| information[(others[a], k)] / (scale(others[a]) * scale(k)));
    let Some(cholesky) = matrix.cholesky() else { return (1.0, Vec::new()) };
    let weights = cholesky.solve(&right);
    let index = (1.0 - weights.dot(&right)).clamp(0.0, 1.0);
    let mut order: Vec<usize> = (0..others.len()).collect();
    order.sort_by(|&a, &b| weights[b].abs().total_cmp(&weights[a].abs()));
    let largest = order.first().map_or(0.0, |&a| weights[a].abs());
    let names = order.iter().take(3).filter(|&&a| weights[a].abs() > 0.3 * largest);
    (index, names.map(|&a| candidate.model.symbols[others[a]].name().to_owned()).collect())
}
