//! Every cause tried on top of a model: fitted with its own noise from many starts.

use super::candidate::{Candidate, Setting};
use super::fit::{Plan, Point, log_likelihoods};
use super::model::{Event, Model};
use super::start::{KINDS, hints, with_cause};
use super::verdict::{DiagnoseError, Effort};
use crate::evaluator::CaseError;
use crate::extension::Extension;
use crate::optimize::stream;
use crate::symbols::Symbol;
use rand::RngExt;
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// What an effort buys in the screening.
#[derive(Debug, Clone, Copy)]
pub struct Spending {
    /// Search of one cause.
    pub plan: Plan,
    /// Hints per cause and drive that are followed.
    pub hints: usize,
    /// Random candidates for the base, and its search.
    pub population: usize,
    /// Search of the base.
    pub base: Plan,
    /// Causes that are cross-fitted.
    pub short_list: usize,
}

/// Of a base's population and turns, the share that another base gets which is only compared with.
const COMPARED: usize = 2;

impl Spending {
    /// For base models that are only compared with.
    #[must_use]
    pub fn compared(&self) -> Spending {
        let base = Plan {
            select: (self.base.select / COMPARED).max(1),
            rough: self.base.rough / COMPARED + 1,
            keep: 1,
            fine: self.base.fine / COMPARED,
            ..self.base
        };
        Spending { population: self.population / COMPARED, base, ..*self }
    }

    /// For further rounds, in which most of what there was is found.
    #[must_use]
    pub fn further(&self) -> Spending {
        let plan = Plan { select: (self.plan.select - 1).max(1), keep: 1, ..self.plan };
        Spending { plan, ..*self }
    }

    /// What an effort buys.
    #[must_use]
    pub fn of(effort: Effort) -> Spending {
        let plan = |select, rough, keep, fine| Plan { select, kinds: 1, rough, keep, fine, tolerance: 0.1 };
        let cause = |select, rough, keep, fine| Plan { kinds: KINDS, ..plan(select, rough, keep, fine) };
        match effort {
            Effort::Quick => {
                Spending { plan: plan(4, 3, 1, 8), hints: 3, population: 96, base: plan(8, 6, 2, 20), short_list: 5 }
            }
            Effort::Normal => Spending {
                plan: cause(3, 3, 2, 12),
                hints: 5,
                population: 256,
                base: plan(12, 8, 3, 30),
                short_list: 6,
            },
            Effort::Thorough => Spending {
                plan: cause(6, 4, 4, 25),
                hints: 8,
                population: 768,
                base: plan(32, 8, 6, 40),
                short_list: 9,
            },
        }
    }
}

/// Candidates of a local population around the best fit, for parameters on which innovations depend in jumps.
const JITTERED: usize = 48;
/// Sizes of that population in coordinates.
const JITTER: [f64; 3] = [0.05, 0.012, 0.003];
/// Relative changes of a size at which an event's time is scanned.
const SCAN: f64 = 0.1;

/// The model with one cause more, fitted; the best of several drives in which an event may happen. `None` if the cause cannot be
/// in this model or not run on these data.
///
/// # Errors
/// As [`Candidate::fitted`].
pub fn explain(
    setting: &Setting<'_>,
    current: &Candidate,
    cause: &'static Extension,
    missing: &[Vec<f64>],
    spending: &Spending,
) -> Result<Option<Candidate>, DiagnoseError> {
    let Ok(variant) = current.variant.with(cause) else { return Ok(None) };
    let causes: Vec<&'static Extension> = current.causes.iter().copied().chain([cause]).collect();
    let speeds = setting.question.train.iter().flat_map(|drive| &drive.trajectory.v_f);
    let fastest = speeds.copied().fold(0.0, f64::max);
    let mut best: Option<Candidate> = None;
    for (scope, hints) in hints(cause, setting.question.train, missing, spending.hints) {
        let events: Vec<Event> = current.model.events.iter().copied().chain(scope).collect();
        let mut model = match setting.model(variant, &events) {
            Err(DiagnoseError::Case(CaseError::Missing { .. } | CaseError::TooShort { .. })) => return Ok(None),
            model => model?,
        };
        let needs_hints = cause.parameters.iter().any(|symbol| symbol.neutral().is_none());
        if needs_hints && hints.is_empty() {
            continue;
        }
        let hints = scanned(setting, current, &mut model, cause, hints, spending.hints)?;
        let starts = with_cause(current, &model, cause, &hints, fastest);
        setting.simulations.fetch_add(model.simulations, Ordering::Relaxed);
        let found = Candidate::fitted(setting, variant, &causes, model, &starts, spending.plan)?;
        let Some(found) = found else { continue };
        let found = jittered(setting, found, cause, spending)?;
        if best.as_ref().is_none_or(|best| found.fit.log_likelihood > best.fit.log_likelihood) {
            best = Some(found);
        }
    }
    Ok(best)
}

/// Hints whose size is that of nothing are times to be scanned: the likelihood at a little more and a little less tells, by the
/// parabola through the three, at which times the size would gain most.
fn scanned(
    setting: &Setting<'_>,
    current: &Candidate,
    model: &mut Model,
    cause: &'static Extension,
    hints: Vec<Vec<(Symbol, f64)>>,
    most: usize,
) -> Result<Vec<Vec<(Symbol, f64)>>, DiagnoseError> {
    let idle = |hint: &Vec<(Symbol, f64)>| hint.iter().any(|(symbol, value)| symbol.neutral() == Some(*value));
    let Some(size) = cause.parameters.iter().copied().find(|symbol| symbol.neutral().is_some()) else {
        return Ok(hints);
    };
    if hints.is_empty() || !hints.iter().all(idle) {
        return Ok(hints);
    }
    let neutral = size.neutral().unwrap_or(0.0);
    let values = model.adopt(&current.model, &current.fit.point.values);
    let mut points = vec![Point { values: values.clone(), noise: current.fit.point.noise }];
    for hint in &hints {
        for change in [-SCAN, SCAN] {
            let mut moved = values.clone();
            for (symbol, value) in hint {
                let k = model.position(*symbol).expect("a parameter of this cause");
                moved[k] = if *symbol == size { neutral + change } else { *value };
            }
            points.push(Point { values: moved, noise: current.fit.point.noise });
        }
    }
    let axes = model.axes.clone();
    let found = log_likelihoods(model, &axes, &setting.whole, &points)?;
    let gain = |i: usize| -> (f64, f64) {
        let (less, more) = (found[1 + 2 * i] - found[0], found[2 + 2 * i] - found[0]);
        let (slope, bend) = (0.5 * (more - less), -(more + less));
        // Curvature below 0 or none: the larger of the two trials.
        let step = if bend > 1e-9 { (slope / bend).clamp(-3.0, 3.0) } else { slope.signum() };
        (slope * step - 0.5 * bend.max(0.0) * step * step, step * SCAN)
    };
    let mut order: Vec<((f64, f64), usize)> = (0..hints.len()).map(|i| (gain(i), i)).collect();
    order.retain(|((gain, _), _)| gain.is_finite());
    order.sort_by(|a, b| b.0.0.total_cmp(&a.0.0));
    let chosen = order.into_iter().take(most).map(|((_, step), i)| {
        hints[i]
            .iter()
            .map(|(symbol, value)| (*symbol, if *symbol == size { neutral + step } else { *value }))
            .collect()
    });
    Ok(chosen.collect())
}

/// Another look around the best fit where derivatives do not show the way.
fn jittered(
    setting: &Setting<'_>,
    found: Candidate,
    cause: &'static Extension,
    spending: &Spending,
) -> Result<Candidate, DiagnoseError> {
    let Candidate { variant, causes, mut model, fit } = found;
    let jumps = |k: &usize| model.axes[*k].step > 1e-4;
    let positions: Vec<usize> = model.positions(cause).into_iter().filter(jumps).collect();
    if positions.is_empty() {
        return Ok(Candidate { variant, causes, model, fit });
    }
    let mut points = vec![fit.point.clone()];
    for i in 0..JITTERED {
        let mut rng = stream(setting.question.seed, u64::MAX, causes.len() as u64, i as u64);
        let mut moved = fit.point.clone();
        for &k in &positions {
            let u = model.axes[k].coordinate(moved.values[k]);
            moved.values[k] = model.axes[k].value(u + JITTER[i % JITTER.len()] * (2.0 * rng.random::<f64>() - 1.0));
        }
        points.push(moved);
    }
    let axes = model.axes.clone();
    let before = model.simulations;
    let likelihoods = log_likelihoods(&mut model, &axes, &setting.whole, &points)?;
    setting.simulations.fetch_add(model.simulations - before, Ordering::Relaxed);
    let best = (0..points.len()).max_by(|&a, &b| likelihoods[a].total_cmp(&likelihoods[b])).expect("points");
    let starts = [fit.point.clone(), points[best].clone()];
    let plan =
        Plan { select: 2, kinds: 1, rough: 0, keep: 2, fine: spending.plan.fine, tolerance: spending.plan.tolerance };
    let again = Candidate::fitted(setting, variant, &causes, model, &starts, plan)?;
    Ok(again.expect("a start that has run runs again"))
}

/// All causes tried on top of a model, those that run; in the order given.
///
/// # Errors
/// As [`explain`].
pub fn screen(
    setting: &Setting<'_>,
    current: &Candidate,
    causes: &[&'static Extension],
    missing: &[Vec<f64>],
    spending: &Spending,
) -> Result<Vec<(&'static Extension, Candidate)>, DiagnoseError> {
    let tried: Result<Vec<_>, DiagnoseError> = causes
        .par_iter()
        .map(|cause| Ok(explain(setting, current, cause, missing, spending)?.map(|found| (*cause, found))))
        .collect();
    Ok(tried?.into_iter().flatten().collect())
}

/// Share of a cause's effect that the other parameters cannot absorb, and those that absorb most of it.
#[must_use]
pub fn identifiability(candidate: &Candidate, cause: &'static Extension) -> (f64, Vec<String>) {
    let information = &candidate.fit.information;
    let positions = candidate.model.positions(cause);
    let Some(&k) = positions.iter().find(|&&k| candidate.model.symbols[k].neutral().is_some()) else {
        return (1.0, Vec::new());
    };
    if information.nrows() <= k || information[(k, k)] <= 0.0 {
        // It does nothing at all here, so nothing can absorb it.
        return (1.0, Vec::new());
    }
    let others: Vec<usize> = (0..candidate.model.axes.len())
        .filter(|j| !positions.contains(j) && information[(*j, *j)] > 1e-9 && !candidate.model.axes[*j].is_fixed())
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
