//! Fits with the size of a cause held while the rest moves, for causes that a base imitates.

use super::fitted_model::{Context, FittedModel};
use super::search_budget::SearchBudget;
use super::start::{highest, steps};
use super::textbook::{fastest, with_textbook_values};
use crate::diagnose::likelihood::descent::descended;
use crate::diagnose::likelihood::fit::{Plan, Point, fit_each, log_likelihoods};
use crate::diagnose::likelihood::model::{Model, is_rugged, is_stepped};
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::DiagnoseError;
use crate::extension::Extension;
use crate::statistics::upper_median;
use crate::symbols::SearchKind;
use std::sync::atomic::Ordering;

/// Of the sizes that were held, so many are followed when they are set free.
const FOLLOWED: usize = 2;
/// First step of the descent with a step of the command held, as a share of the ranges, and the first of its turns.
const FIRST_STEP: f64 = 0.03;
const SHIFTED: u64 = 100;
/// Turns with a size held, of all sizes and then of the likelier half.
const HOLDING: Plan =
    Plan { select: usize::MAX, kinds: 1, rough: 2, keep: 1, fine: 2, tolerance: 0.1, least: [0.0; 2] };

/// Starts for a cause whose size was held while the rest moved: what a base lacks it makes up for with parameters that are far off, and
/// from there a size that is set free goes back to nothing. A strong observer sees the way even where a nearly free simulation is far
/// off. Of steps of the command the rest is moved by a search without derivatives. Without sizes of its own to hold, none.
///
/// # Errors
/// As [`fit_each`].
pub fn from_held(
    setting: &Context<'_>,
    current: &FittedModel,
    model: &Model,
    cause: &'static Extension,
) -> Result<Vec<Point>, DiagnoseError> {
    let before = model.simulations();
    let values = model.adopt(&current.model, &current.fit.point.values);
    let noise = current.fit.point.noise;
    let step = step(model, cause);
    let (sizes, values, mut points) = if let Some(limit) = limit(model, cause) {
        let likeliest = reached(setting, current, model, limit)?;
        (limits(model, limit), values, vec![likeliest])
    } else if let Some(step) = step {
        (standing_out(setting, current, model, step)?, values, Vec::new())
    } else if is_held_at_textbook_values(model, cause, &noise) {
        let textbook = with_textbook_values(model, &values, fastest(setting.question.train));
        (sizes(model, cause), textbook, Vec::new())
    } else {
        // Where the present model is about right, what is missing shows a way by itself.
        return Ok(Vec::new());
    };
    let start = Point { values, noise: if step.is_some() { noise } else { noise.strong() } };
    points.extend(held(setting, model, &start, sizes, step.is_some())?);
    setting.simulations.fetch_add(model.simulations() - before, Ordering::Relaxed);
    Ok(points)
}

/// True where [`from_held`] starts from textbook values.
#[must_use]
pub fn is_held_at_textbook_values(model: &Model, cause: &'static Extension, noise: &Noise) -> bool {
    let limited = limit(model, cause).is_some() || step(model, cause).is_some();
    is_astray(noise) && !limited && !sizes(model, cause).is_empty()
}

/// Where the rest goes while some sizes are held: the likeliest. Where the likelihood is rugged, the rest is moved without derivatives.
fn held(
    setting: &Context<'_>,
    model: &Model,
    start: &Point,
    sizes: Vec<Vec<(usize, f64)>>,
    rugged: bool,
) -> Result<Vec<Point>, DiagnoseError> {
    let mut starts = Vec::with_capacity(sizes.len());
    for (turn, size) in sizes.into_iter().enumerate() {
        let (mut axes, mut start) = (model.axes.clone(), start.clone());
        for (k, value) in size {
            start.values[k] = value;
            axes[k] = Axis::held(value);
        }
        if rugged {
            let turn = SHIFTED + turn as u64;
            start = descended(model, &axes, &setting.whole, &start, FIRST_STEP, (setting.question.seed, turn))?
                .unwrap_or(start);
        }
        starts.push((axes, start));
    }
    let plan = Plan { keep: starts.len().div_ceil(2).max(FOLLOWED), ..HOLDING };
    let found = fit_each(model, &setting.whole, &starts, plan)?;
    Ok(found.into_iter().take(FOLLOWED).map(|fit| fit.point).collect())
}

/// True where something is missing that the model makes up for by its missing acceleration.
#[must_use]
pub fn is_lost(noise: &Noise) -> bool {
    noise.sigma_d > POLICY.lost_size && noise.tau_d > POLICY.lost_time
}

/// Six times the gusts of 0.05 m/s² over 2 s, as the growth of the square of the speed's error \[m²/s³\] (half of it).
const ASTRAY: f64 = 0.03;

/// True where so much is missing that the model may be far off: large or long, and so less than [`is_lost`] asks.
#[must_use]
pub fn is_astray(noise: &Noise) -> bool {
    noise.sigma_d.powi(2) * noise.tau_d > ASTRAY
}

/// The parameter of a cause that does nothing where it is largest.
fn limit(model: &Model, cause: &'static Extension) -> Option<usize> {
    if cause.search() == SearchKind::Limit { model.positions(cause).first().copied() } else { None }
}

/// The only parameter of a cause, if innovations depend on it in jumps.
fn step(model: &Model, cause: &'static Extension) -> Option<usize> {
    if is_rugged(cause) { model.positions(cause).first().copied() } else { None }
}

/// Steps of the command to be held: those of a dense row that are likelier than the ones around them. The larger a step, the worse it
/// makes a base that is off by a little, so that the likeliest of all is next to none; but the right one stands out. Where none does,
/// there are no steps, and no search without derivatives is spent on them.
fn standing_out(
    setting: &Context<'_>,
    current: &FittedModel,
    model: &Model,
    step: usize,
) -> Result<Vec<Vec<(usize, f64)>>, DiagnoseError> {
    let values = model.adopt(&current.model, &current.fit.point.values);
    let sizes = steps(model.axes[step].upper);
    let moved = |size: &f64| {
        let mut values = values.clone();
        values[step] = *size;
        Point { values, noise: current.fit.point.noise }
    };
    let row: Vec<Point> = sizes.iter().map(moved).collect();
    let bounds = model.axes.clone();
    let likelihoods = log_likelihoods(model, &bounds, &setting.whole, &row)?;
    let heights = heights(&likelihoods);
    let astray = is_astray(&current.fit.point.noise);
    let promises = |i: &usize| promises(heights[*i], current.fit.log_likelihood - likelihoods[*i], astray);
    let stand_out = highest(&heights, APART, STAND_OUT).into_iter().filter(promises);
    Ok(stand_out.map(|i| vec![(step, sizes[i])]).collect())
}

/// Steps of the command that are held, and how far apart in the row they lie at least.
const STAND_OUT: usize = 2;
const APART: usize = 4;
/// How much a size has to stand out \[nats\], and how much less likely than the model without steps it may be, as a share of that. Steps of a
/// real command stand out by hundreds of nats and lose less than that; chance stands out by tens and loses more. Where the base is far
/// off, only the height tells.
const HIGH: f64 = 25.0;
const HIGH_ASTRAY: f64 = 100.0;
const DEEP: f64 = 2.0;

/// True for a size that stands out enough, with what it loses, to be held.
fn promises(height: f64, loss: f64, astray: bool) -> bool {
    if astray { height > HIGH_ASTRAY } else { height > HIGH && loss < DEEP * height }
}

/// How much higher a row is at each position than around it.
fn heights(row: &[f64]) -> Vec<f64> {
    const AROUND: usize = 12;
    let height = |i: usize| {
        let around = &row[i.saturating_sub(AROUND)..(i + AROUND + 1).min(row.len())];
        row[i] - upper_median(around.iter().copied()).expect("itself at least")
    };
    (0..row.len()).map(height).collect()
}

/// Limits to be held: where one is reached often, a base imitates it; from there, one that is reached makes things worse until the
/// rest has moved, and one that is not shows no way.
fn limits(model: &Model, limit: usize) -> Vec<Vec<(usize, f64)>> {
    const SIZES: [f64; 7] = [0.15, 0.22, 0.29, 0.36, 0.43, 0.52, 0.63];
    SIZES.iter().map(|size| vec![(limit, model.axes[limit].value(1.0 - size))]).collect()
}

/// Where a limit is reached once or twice, the base is right but for that: the likeliest of a dense row of them.
fn reached(setting: &Context<'_>, current: &FittedModel, model: &Model, limit: usize) -> Result<Point, DiagnoseError> {
    const ROW: usize = 80;
    let (values, axis) = (model.adopt(&current.model, &current.fit.point.values), model.axes[limit]);
    let row = |i: usize| {
        let mut values = values.clone();
        values[limit] = axis.value((i as f64 + 0.5) / ROW as f64);
        Point { values, noise: current.fit.point.noise }
    };
    let row: Vec<Point> = (0..ROW).map(row).collect();
    let bounds = model.axes.clone();
    let likelihoods = log_likelihoods(model, &bounds, &setting.whole, &row)?;
    let likeliest = (0..ROW).max_by(|&a, &b| likelihoods[a].total_cmp(&likelihoods[b])).expect("a row");
    Ok(row[likeliest].clone())
}

/// Sizes to be held of a cause that has nothing but sizes: all of them together, at shares of the way from nothing to the ends.
fn sizes(model: &Model, cause: &'static Extension) -> Vec<Vec<(usize, f64)>> {
    const SHARES: [f64; 3] = [0.06, 0.15, 0.3];
    let positions = model.positions(cause);
    let neutral = |k: usize| model.symbols[k].neutral().filter(|_| !is_stepped(model.symbols[k]));
    let Some(neutral) = positions.iter().map(|&k| neutral(k)).collect::<Option<Vec<f64>>>() else { return Vec::new() };
    let held = |end: f64, share: f64| -> Vec<(usize, f64)> {
        let size = |(&k, &neutral): (&usize, &f64)| {
            let (axis, from) = (model.axes[k], model.axes[k].coordinate(neutral));
            (k, axis.value(from + share * (end - from)))
        };
        positions.iter().zip(&neutral).map(size).collect()
    };
    let idle = |size: &[(usize, f64)]| size.iter().zip(&neutral).all(|((_, value), neutral)| value == neutral);
    let all = [1.0, 0.0].iter().flat_map(|end| SHARES.map(|share| held(*end, share)));
    all.filter(|size| !idle(size)).collect()
}

/// The likelier of a fit and one from sizes that were held: likelihoods under a strong observer do not compare with others, so they
/// do not take part in the same race.
///
/// # Errors
/// As [`FittedModel::fitted`].
pub fn set_free(
    setting: &Context<'_>,
    found: FittedModel,
    held: &[Point],
    spending: &SearchBudget,
) -> Result<FittedModel, DiagnoseError> {
    if held.is_empty() {
        return Ok(found);
    }
    let model = setting.model(found.variant, &found.model.events)?;
    // One of those that were held is given up after some turns.
    let plan = Plan { select: held.len(), kinds: 1, keep: (held.len() - 1).max(1), ..spending.plan };
    let other = FittedModel::fitted(setting, found.variant, &found.causes, model, held, plan)?;
    let better = other.filter(|other| other.fit.log_likelihood > found.fit.log_likelihood);
    Ok(better.unwrap_or(found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planted_steps_promise_and_others_do_not() {
        for (height, loss, astray) in [(300.0, 180.0, false), (300.0, 15_000.0, true)] {
            assert!(promises(height, loss, astray), "planted: {height} nats");
        }
        for (height, loss, astray) in [(25.5, 102.0, false), (20.0, 0.0, false), (77.0, 0.0, true), (52.0, 0.0, true)] {
            assert!(!promises(height, loss, astray), "not there: {height} nats");
        }
    }

    #[test]
    fn what_stands_out_is_not_what_is_largest() {
        // Falls to -1000; at 60 it is 300 above its neighbours.
        let row: Vec<f64> = (0..100).map(|i| f64::from(-10 * i + if i == 60 { 300 } else { 0 })).collect();
        assert_eq!(highest(&heights(&row), APART, 1), [60]);
        let mut broken = row.clone();
        broken[60] = f64::NEG_INFINITY;
        assert!(!highest(&heights(&broken), APART, 100).contains(&60));
    }
}
