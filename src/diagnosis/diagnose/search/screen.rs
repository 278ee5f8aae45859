//! Tries every cause on top of a model: fits with free noise from many starts.

use super::fitted_model::{Context, FittedModel};
use super::search_budget::SearchBudget;
use super::skipped::{Skipped, Untried};
use super::strategy::{Stop, Task, explain};
use super::textbook::fastest;
use crate::diagnose::likelihood::model::{LEAD, is_rugged};
use crate::diagnose::question::DiagnoseError;
use crate::extension::Extension;
use crate::wgsl::extension_named;
use rayon::prelude::*;

/// A cause, and the present model with it.
pub type ScreenedCause = (&'static Extension, FittedModel);

/// Cost class of a cause: times need a scan, jumps a search without derivatives.
fn takes(cause: &Extension) -> usize {
    let times = cause.parameters.iter().filter(|symbol| symbol.is_time()).count();
    2 * times + usize::from(is_rugged(cause))
}

/// Tries all causes on top of a model; returns those that run, and those that could not be tried, both in the order given.
///
/// # Errors
/// As [`FittedModel::fitted`].
pub fn screen(
    setting: &Context<'_>,
    current: &FittedModel,
    causes: &[&'static Extension],
    missing: &[Vec<f64>],
    spending: &SearchBudget,
) -> Result<(Vec<ScreenedCause>, Vec<Skipped>), DiagnoseError> {
    // The slowest causes start first, so that all threads finish at about the same time.
    let mut order: Vec<usize> = (0..causes.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(takes(causes[i])));
    let fastest = fastest(setting.question.train);
    let explained = |cause: &'static Extension| -> Result<Result<FittedModel, Untried>, DiagnoseError> {
        let variant = match current.variant.with(cause) {
            Ok(variant) => variant,
            Err(conflict) => return Ok(Err(Untried::Conflict(conflict))),
        };
        match explain(&Task { setting, current, cause, variant, missing, budget: spending, fastest }) {
            Ok(found) => Ok(Ok(found)),
            Err(Stop::Untried(why)) => Ok(Err(why)),
            Err(Stop::Failed(error)) => Err(error),
        }
    };
    let all: Result<Vec<_>, DiagnoseError> =
        order.into_iter().par_bridge().map(|i| Ok((i, explained(causes[i])?))).collect();
    let mut all = all?;
    all.sort_unstable_by_key(|(i, _)| *i);
    let (mut tried, mut dropped) = (Vec::new(), Vec::new());
    for (i, found) in all {
        match found {
            Ok(found) => tried.push((causes[i], found)),
            Err(why) => dropped.push((causes[i], why)),
        }
    }
    Ok((tried, dropped))
}

/// Share of a cause's effect that the other parameters cannot absorb, and the parameters that absorb most of the rest.
#[must_use]
pub fn identifiability(candidate: &FittedModel, cause: &'static Extension) -> (f64, Vec<String>) {
    let positions = candidate.model.positions(cause);
    let Some(&k) = positions.iter().find(|&&k| candidate.model.symbols[k].neutral().is_some()) else {
        return (1.0, Vec::new());
    };
    let (index, weights) = own_share(candidate, &positions, k);
    let mut order: Vec<&(usize, f64)> = weights.iter().collect();
    order.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let largest = order.first().map_or(0.0, |(_, weight)| weight.abs());
    let names = order.iter().take(3).filter(|(_, weight)| weight.abs() > 0.3 * largest);
    (index, names.map(|(j, _)| candidate.model.symbols[*j].name().to_owned()).collect())
}

/// Share of a parameter's information that the others leave, and their weights in the part that they absorb. Those of `beside` and the
/// nuisance lead absorb nothing.
pub fn own_share(candidate: &FittedModel, beside: &[usize], k: usize) -> (f64, Vec<(usize, f64)>) {
    let information = &candidate.fit.information;
    if information.nrows() <= k || information[(k, k)] <= 0.0 {
        // The cause does nothing here, so nothing can absorb it.
        return (1.0, Vec::new());
    }
    // The nuisance lead is at most 0.05 s and cannot absorb a larger effect, whatever its derivative.
    let lead = extension_named(LEAD).map_or_else(Vec::new, |lead| candidate.model.positions(lead));
    let others: Vec<usize> = (0..candidate.model.axes.len())
        .filter(|j| *j != k && !beside.contains(j) && !lead.contains(j))
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
    (index, others.into_iter().zip(weights.iter().copied()).collect())
}
