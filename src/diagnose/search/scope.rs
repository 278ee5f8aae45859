//! Where a cause may act: in all drives, or, for what happens once, in any one of them; and where its fit starts there.

use super::fitted_model::{Context, FittedModel};
use super::profile_grid::is_held_at_textbook_values;
use super::scan::{are_idle, likeliest, scanned, timed};
use super::search_budget::SearchBudget;
use super::skipped::Untried;
use super::start::{Hint, KINDS, hints, with_cause};
use super::textbook::fastest;
use super::undisturbed::{UNDISTURBED_KINDS, Undisturbed, undisturbed};
use crate::catalog::Variant;
use crate::diagnose::likelihood::fit::Point;
use crate::diagnose::likelihood::model::{Event, Model};
use crate::diagnose::question::DiagnoseError;
use crate::evaluator::CaseError;
use crate::extension::Extension;
use crate::symbols::SearchKind;
use std::sync::atomic::Ordering;

/// Where a cause may act, and where its fit starts.
pub struct Scope {
    /// The model with the cause, over all drives.
    pub model: Model,
    /// Where its fit starts.
    pub starts: Vec<Point>,
    /// Kinds of starts, which come in turn: those of different kinds do not compare.
    pub kinds: usize,
    /// True for an event whose times were scanned.
    pub event: bool,
    /// True where it starts from the undisturbed model.
    pub usual: bool,
    /// How much what was scanned promises under the present observer and under a nearly free one \[nats\].
    promise: [f64; 2],
}

/// The scopes of a cause: one over all drives, and, for what happens once, one for each drive; of the latter only those that promise most
/// under one of the observers.
///
/// # Errors
/// As [`Model::new`] and [`crate::diagnose::likelihood::fit::log_likelihoods`]; within, why the cause cannot be tried on these data.
pub fn scopes(
    setting: &Context<'_>,
    current: &FittedModel,
    variant: Variant,
    cause: &'static Extension,
    missing: &[Vec<f64>],
    spending: &SearchBudget,
) -> Result<Result<Vec<Scope>, Untried>, DiagnoseError> {
    let needs_hints = cause.parameters.iter().any(|symbol| symbol.neutral().is_none());
    let stretch = cause.search() == SearchKind::Stretch;
    // A stretch in which something else drives the car is what spoils a base most.
    let usual = if stretch && current.causes.is_empty() { undisturbed(setting, current)? } else { None };
    // Stretches that single drives promise, as the present model and as the undisturbed one see them.
    let (mut promised, mut usually_promised): (Vec<Hint>, Vec<Hint>) = (Vec::new(), Vec::new());
    let mut scopes: Vec<Scope> = Vec::new();
    for (drive, hints) in hints(cause, setting.question.train, missing, spending.hints) {
        let events: Vec<Event> = current.model.events.iter().copied().chain(drive).collect();
        let model = match setting.model(variant, &events) {
            Err(DiagnoseError::Case(error @ (CaseError::Missing { .. } | CaseError::TooShort { .. }))) => {
                return Ok(Err(Untried::Data(error)));
            }
            model => model?,
        };
        if needs_hints && hints.is_empty() {
            continue;
        }
        let first = scopes.len();
        if are_idle(&hints) {
            let fastest = fastest(setting.question.train);
            let (starts, promise) = timed(setting, current, &model, &hints, spending.hints, fastest)?;
            scopes.push(Scope { model, starts, kinds: 1, event: true, usual: false, promise });
        } else if stretch {
            // One in all drives shows in each of them.
            let of = |promised: &[Hint]| match drive {
                None if !promised.is_empty() => promised.to_vec(),
                _ => hints.clone(),
            };
            if let Some(usual) = &usual {
                let model = setting.model(variant, &events)?;
                let (scope, found) = from_undisturbed(setting, usual, model, of(&usually_promised), spending)?;
                usually_promised.extend(found);
                scopes.push(scope);
            }
            let at = present(current, &model);
            let (found, promise) = likeliest(&at, &model, setting, of(&promised), spending.hints)?;
            scopes.push(from_present(setting, current, model, cause, &found, promise));
            promised.extend(found);
        } else {
            let at = present(current, &model);
            let hints = match cause.search() == SearchKind::Integral {
                true => hints,
                false => scanned(setting, &at, &model, hints, spending.hints)?,
            };
            scopes.push(from_present(setting, current, model, cause, &hints, [0.0; 2]));
        }
        for scope in &scopes[first..] {
            setting.simulations.fetch_add(scope.model.simulations(), Ordering::Relaxed);
        }
    }
    let most = |usual: bool, k: usize| {
        let alike = scopes.iter().filter(|scope| scope.usual == usual);
        alike.map(|scope| scope.promise[k]).fold(f64::NEG_INFINITY, f64::max)
    };
    let most = [false, true].map(|usual| [most(usual, 0), most(usual, 1)]);
    scopes.retain(|scope| (0..2).any(|k| scope.promise[k] >= most[usize::from(scope.usual)][k]));
    Ok(Ok(scopes))
}

/// The present model in a model that has a cause more.
fn present(current: &FittedModel, model: &Model) -> Point {
    Point { values: model.adopt(&current.model, &current.fit.point.values), noise: current.fit.point.noise }
}

/// Starts from the present model, at each of the hints.
fn from_present(
    setting: &Context<'_>,
    current: &FittedModel,
    model: Model,
    cause: &'static Extension,
    hints: &[Hint],
    promise: [f64; 2],
) -> Scope {
    let noise = current.fit.point.noise;
    let train = setting.question.train;
    // Where sizes are held at textbook values, the same starts without are not needed.
    let textbook = (!is_held_at_textbook_values(&model, cause, &noise)).then(|| fastest(train));
    let starts = with_cause(current, &model, cause, hints, textbook);
    let kinds = KINDS - usize::from(textbook.is_none());
    Scope { model, starts, kinds, event: false, usual: false, promise }
}

/// Starts from the undisturbed model, on their own: next to starts from the spoilt model these would not be followed. With them, the
/// stretches at which they are.
fn from_undisturbed(
    setting: &Context<'_>,
    usual: &Undisturbed,
    model: Model,
    hints: Vec<Hint>,
    spending: &SearchBudget,
) -> Result<(Scope, Vec<Hint>), DiagnoseError> {
    let (stretches, promise) = usual.walked(setting, &model, hints, spending.hints)?;
    let starts = usual.starts(&model, &stretches);
    Ok((Scope { model, starts, kinds: UNDISTURBED_KINDS, event: false, usual: true, promise }, stretches))
}
