//! Every cause tried on top of a model: fitted with its own noise from many starts.

use super::cmaes_refine::polished;
use super::fitted_model::{Context, FittedModel};
use super::profile_grid::{from_held, set_free};
use super::scope::{Scope, scopes};
use super::search_budget::SearchBudget;
use super::skipped::{Skipped, Untried};
use super::start::{FOR_AN_EVENT, FOR_STEPS, KINDS, softened_by};
use crate::catalog::Variant;
use crate::diagnose::likelihood::fit::{Plan, Point, log_likelihoods};
use crate::diagnose::likelihood::model::{LEAD, Model, is_rugged, is_stepped};
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::likelihood::streams;
use crate::diagnose::question::DiagnoseError;
use crate::extension::Extension;
use crate::optimize::stream;
use crate::symbols::SearchKind;
use crate::wgsl::extension_named;
use rand::RngExt;
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// Candidates of a local population around the best fit, for parameters on which innovations depend in jumps.
const JITTERED: usize = 80;
/// Sizes of that population in coordinates.
const JITTER: [f64; 5] = [0.05, 0.012, 0.003, 8e-4, 2e-4];
/// Such populations in turn, as long as each gains this much \[nats\].
const JITTERS: (usize, f64) = (4, 2.0);

/// Gain of steps of the command whose size is worth a search without derivatives \[nats\]: where they are, held sizes have found most.
const WORTH_POLISHING: f64 = 25.0;

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
        let mut found = jittered(setting, found, cause, spending)?;
        if is_rugged(cause) && found.fit.log_likelihood > current.fit.log_likelihood + WORTH_POLISHING {
            found = polished(setting, found, spending.plan)?;
        }
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

/// Another look around the best fit where derivatives do not show the way.
fn jittered(
    setting: &Context<'_>,
    mut found: FittedModel,
    cause: &'static Extension,
    spending: &SearchBudget,
) -> Result<FittedModel, DiagnoseError> {
    let positions: Vec<usize> = found
        .model
        .positions(cause)
        .into_iter()
        .filter(|&k| is_stepped(found.model.symbols[k]) && !found.model.axes[k].is_fixed())
        .collect();
    if positions.is_empty() {
        return Ok(found);
    }
    for turn in 0..JITTERS.0 {
        let FittedModel { variant, causes, model, fit } = found;
        let mut points = vec![fit.point.clone()];
        for i in 0..JITTERED {
            let mut rng = stream(setting.question.seed, streams::AROUND - turn as u64, causes.len() as u64, i as u64);
            let mut moved = fit.point.clone();
            for &k in &positions {
                let u = model.axes[k].coordinate(moved.values[k]);
                moved.values[k] = model.axes[k].value(u + JITTER[i % JITTER.len()] * (2.0 * rng.random::<f64>() - 1.0));
            }
            points.push(moved);
        }
        points.extend(stretched(&model, &fit.point, cause));
        let axes = model.axes.clone();
        let before = model.simulations();
        let likelihoods = log_likelihoods(&model, &axes, &setting.whole, &points)?;
        setting.simulations.fetch_add(model.simulations() - before, Ordering::Relaxed);
        let best = (0..points.len()).max_by(|&a, &b| likelihoods[a].total_cmp(&likelihoods[b])).expect("points");
        let starts = [fit.point.clone(), points[best].clone()];
        let plan = Plan { select: 2, kinds: 1, rough: 0, keep: 2, ..spending.plan };
        let again = FittedModel::fitted(setting, variant, &causes, model, &starts, plan)?;
        found = again.expect("a start that has run runs again");
        if found.fit.log_likelihood < fit.log_likelihood + JITTERS.1 {
            break;
        }
    }
    Ok(found)
}

/// A stretch made longer and shorter, with its begin or its end kept and its size as it is and changed: all together, for each alone is
/// worse.
fn stretched(model: &Model, at: &Point, cause: &'static Extension) -> Vec<Point> {
    const LENGTHS: [f64; 6] = [0.35, 0.5, 0.7, 1.4, 2.0, 2.8];
    const SIZES: [f64; 7] = [0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3];
    let times: Vec<usize> =
        cause.parameters.iter().filter(|s| s.is_time()).filter_map(|s| model.position(*s)).collect();
    let [begin, length] = times[..] else { return Vec::new() };
    let size = cause.parameters.iter().copied().find(|s| !s.is_time()).and_then(|size| model.position(size));
    let Some(size) = size else { return Vec::new() };
    let mut points = Vec::new();
    for (longer, larger) in LENGTHS.iter().flat_map(|longer| SIZES.map(|larger| (*longer, larger))) {
        for kept_end in [false, true] {
            let mut values = at.values.clone();
            let mut set = |k: usize, value: f64| values[k] = value.clamp(model.axes[k].lower, model.axes[k].upper);
            set(length, longer * at.values[length]);
            set(size, larger * at.values[size]);
            if kept_end {
                set(begin, at.values[begin] - (longer - 1.0) * at.values[length]);
            }
            points.push(Point { values, noise: at.noise });
        }
    }
    points
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::made_up;
    use crate::symbols::Symbol;

    #[test]
    fn a_stretch_is_moved_with_either_end_kept() {
        let drives = [made_up::drive("made_up.csv", 0.0)];
        let cause = extension_named("set_speed_change").expect("in the library");
        let variant = "l-cth".parse::<Variant>().expect("a base").with(cause).expect("they go together");
        let model = Model::new(variant, &drives, &Overrides::new(), &[]).expect("a model");
        let noise = Noise { sigma_d: 0.05, tau_d: 2.0, r_s: 0.02, r_v: 0.02, r_l: 1e-3 };
        let mut at = Point { values: model.axes.iter().map(|axis| axis.value(0.5)).collect(), noise };
        let times: Vec<usize> = cause
            .parameters
            .iter()
            .filter(|s| s.is_time())
            .map(|s: &Symbol| model.position(*s).expect("its own"))
            .collect();
        let length = model.axes[times[1]].lower.max(4.0);
        at.values[times[1]] = length;
        let moved = stretched(&model, &at, cause);
        assert_eq!(moved.len(), 84);
        let ends = |point: &Point| [point.values[times[0]], point.values[times[0]] + point.values[times[1]]];
        let [begin, end] = ends(&at);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let longer: Vec<[f64; 2]> =
            moved.iter().filter(|point| near(point.values[times[1]], 2.0 * length)).map(ends).collect();
        assert_eq!(longer.len(), 14);
        assert_eq!(longer.iter().filter(|[b, e]| near(*b, begin) && near(*e, end + length)).count(), 7);
        assert_eq!(longer.iter().filter(|[b, e]| near(*b, begin - length) && near(*e, end)).count(), 7);
    }
}
