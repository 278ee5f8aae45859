//! A stretch of time: another controller that drives the car for half a minute spoils a calibration of all parameters.

use super::event::acting;
use super::scan::likeliest;
use super::{Scope, Search, Stop, Task, Values, moved};
use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::fit::{Plan, Point, fit, log_likelihoods};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::robust::Mask;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, ELSEWHERE, scored};
use crate::diagnose::search::textbook::with_textbook_values;
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// Lengths of stretches in the scan \[s\], and their distance as a share of the length.
const LENGTHS: [f64; 5] = [12.0, 20.0, 33.0, 55.0, 90.0];
const STRIDE: f64 = 0.4;
/// Quantiles of the speed that the scan tries.
const BELOW: [f64; 2] = [0.5, 0.95];
/// Share of the blocks of 30 s that count when parts of drives are compared; the others may contain the effect.
const USUAL: f64 = 0.8;
/// Iterations on a part.
const PART: Plan = Plan { rough: 6, keep: 1, ..ELSEWHERE };

/// See [`Search`].
pub struct Stretch;

impl Search for Stretch {
    fn starts(&self, task: &Task<'_>) -> Result<Vec<Scope>, Stop> {
        // A stretch with another controller spoils a base most.
        let usual = if task.current.causes.is_empty() { undisturbed(task)? } else { None };
        // The stretches that single drives suggest, under the present model and under the undisturbed one.
        let (mut promised, mut usually_promised): (Vec<Values>, Vec<Values>) = Default::default();
        let mut scopes = Vec::new();
        for drive in acting(task.setting.question.train) {
            let model = task.model(drive)?;
            let Some(places) = places(task, &model, drive) else { return Ok(Vec::new()) };
            if places.is_empty() {
                continue;
            }
            // A stretch that is in all drives shows in each of them.
            let of = |promised: &[Values]| match drive {
                None if !promised.is_empty() => promised.to_vec(),
                _ => places.clone(),
            };
            if let Some(usual) = &usual {
                let (scope, found) = from_undisturbed(task, usual, task.model(drive)?, of(&usually_promised))?;
                usually_promised.extend(found);
                scopes.push(scope);
            }
            let present = task.present(&model);
            let (found, promise) = likeliest(task.setting, &present, &model, of(&promised), task.budget.hints)?;
            scopes.push(Scope { promise, ..task.scope(model, &found, Vec::new()) });
            promised.extend(found);
        }
        Ok(scopes)
    }
}

/// Stretches of the drives in which a cause may act: speed, start and length. `None` for a cause without a size.
fn places(task: &Task<'_>, model: &Model, drive: Option<usize>) -> Option<Vec<Values>> {
    let positions = model.positions(task.cause);
    let size = *positions.iter().find(|&&k| model.symbols[k].neutral().is_some())?;
    let mut times = positions.iter().copied().filter(|&k| model.symbols[k].is_time());
    let (begin, length) = times.next().zip(times.next())?;
    let inside = task.setting.question.train.iter().enumerate().filter(|(k, _)| drive.is_none_or(|drive| drive == *k));
    let found = inside.flat_map(|(_, drive)| behind_faster(drive));
    Some(found.map(|(t, dur, v)| vec![(size, v), (begin, t), (length, dur)]).collect())
}

/// Stretches of several lengths in which the car ahead is the faster one on average, with start, length and a speed that the follower
/// hardly exceeds there, as under a lower set speed.
fn behind_faster(drive: &Drive) -> Vec<(f64, f64, f64)> {
    let data = &drive.trajectory;
    let mut found = Vec::new();
    for length in LENGTHS {
        let samples = (length / data.dt).round() as usize;
        let stride = ((STRIDE * length / data.dt).round() as usize).max(1);
        for from in (0..data.len().saturating_sub(samples)).step_by(stride) {
            let range = from..from + samples;
            let faster = range.clone().map(|t| data.v_l[t] - data.v_f[t]).sum::<f64>();
            let mut speeds = data.v_f[range].to_vec();
            speeds.sort_by(f64::total_cmp);
            if faster > 0.0 && speeds[samples / 2] > 1.0 {
                let at = |share: f64| speeds[((samples - 1) as f64 * share) as usize];
                found.extend(BELOW.map(|share| (data.t[from], length, at(share))));
            }
        }
    }
    found
}

/// A model fitted to data without the effect.
struct Undisturbed {
    model: Model,
    point: Point,
}

/// The model fitted to one half of one training drive, from textbook values and from the present ones: of all halves, the one whose fit is
/// likeliest over most of the time. `None` if so little is missing that the fit to all data cannot be spoilt.
fn undisturbed(task: &Task<'_>) -> Result<Option<Undisturbed>, DiagnoseError> {
    let Task { setting, current, .. } = *task;
    let noise = current.fit.point.noise;
    if !noise.is_astray() {
        return Ok(None);
    }
    let halves: Vec<(usize, bool)> = (0..setting.whole.len()).flat_map(|k| [(k, false), (k, true)]).collect();
    let fitted = |half: &(usize, bool)| -> Result<Option<(f64, Undisturbed)>, DiagnoseError> {
        let model = setting.model(current.variant, &current.model.events)?;
        let values = model.adopt(&current.model, &current.fit.point.values);
        let textbook = with_textbook_values(&model, &values, task.fastest);
        let starts = [textbook, values].map(|values| Point { values, noise: noise.strong() });
        let found = fit(&model, &model.axes, &part(&setting.whole, *half), &starts, PART)?.into_iter().next();
        let Some(point) = found.map(|fit| fit.point) else { return Ok(None) };
        let mut blocks = scored(&model, &point, &setting.whole)?.concat();
        blocks.sort_by(|a, b| b.total_cmp(a));
        blocks.truncate((USUAL * blocks.len() as f64).ceil() as usize);
        setting.simulations.fetch_add(model.simulations(), Ordering::Relaxed);
        Ok(Some((blocks.iter().sum(), Undisturbed { model, point })))
    };
    let found: Result<Vec<_>, _> = halves.par_iter().map(fitted).collect();
    let best = found?.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0));
    Ok(best.map(|(_, best)| best))
}

/// The samples that count in the first or the second half of one drive.
fn part(whole: &[Mask], (drive, second): (usize, bool)) -> Vec<Mask> {
    let of = |(k, mask): (usize, &Mask)| -> Mask {
        mask.iter().enumerate().map(|(t, counts)| *counts && k == drive && (t >= mask.len() / 2) == second).collect()
    };
    whole.iter().enumerate().map(of).collect()
}

/// Starts at the likeliest stretches on top of the undisturbed model, under its observer and under a strong one, and the stretches.
fn from_undisturbed(
    task: &Task<'_>,
    usual: &Undisturbed,
    model: Model,
    places: Vec<Values>,
) -> Result<(Scope, Vec<Values>), DiagnoseError> {
    let at = Point { values: model.adopt(&usual.model, &usual.point.values), noise: usual.point.noise };
    let (found, promise) = likeliest(task.setting, &at, &model, places, task.budget.hints)?;
    // Those after the likeliest of each observer are worse starts of the same stretches.
    let walk = |(i, place): (usize, Values)| match i % task.budget.hints {
        0 => walked(task.setting, &at, &model, place),
        _ => Ok(place),
    };
    let found: Vec<Values> = found.into_iter().enumerate().map(walk).collect::<Result<_, _>>()?;
    let under = |noise| {
        let (model, at) = (&model, &at);
        found.iter().map(move |place| Point { values: moved(model, &at.values, place), noise })
    };
    let starts = under(at.noise).chain(under(at.noise.strong())).collect();
    Ok((Scope { model, starts, held: Vec::new(), alone: true, promise }, found))
}

/// Moves both ends and the size of a stretch in ever smaller steps while the likelihood grows: the slope in one of them is useless while
/// another is off.
fn walked(setting: &Context<'_>, at: &Point, model: &Model, mut place: Values) -> Result<Values, DiagnoseError> {
    /// Steps of the ends \[s\]; the steps of the size are a tenth of each.
    const STEPS: [f64; 7] = [16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25];
    /// Largest number of moves per step.
    const MOVES: usize = 8;
    /// Directions of the moves in size, start and end.
    const AROUND: [[f64; 3]; 10] = [
        [0.0, -1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
        [0.0, -1.0, 1.0],
        [0.0, 1.0, 1.0],
        [0.0, -1.0, -1.0],
        [0.0, 1.0, -1.0],
        [0.1, 0.0, 0.0],
        [-0.1, 0.0, 0.0],
    ];
    for step in STEPS {
        for _ in 0..MOVES {
            let moves = AROUND.map(|[size, begin, end]| [size, begin, end - begin]);
            let other = |by: [f64; 3]| -> Values {
                place.iter().zip(by).map(|(&(k, value), by)| (k, value + step * by)).collect()
            };
            let around: Vec<Values> = moves.into_iter().map(other).filter(|place| place[2].1 > 0.0).collect();
            let all = std::iter::once(&place).chain(&around);
            let points: Vec<Point> =
                all.map(|place| Point { values: moved(model, &at.values, place), noise: at.noise }).collect();
            let found = log_likelihoods(model, &model.axes, &setting.whole, &points)?;
            let best = (0..found.len()).max_by(|&a, &b| found[a].total_cmp(&found[b]).then(b.cmp(&a)));
            match best {
                Some(best) if best > 0 && found[best].is_finite() => place.clone_from(&around[best - 1]),
                _ => break,
            }
        }
    }
    Ok(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_all_samples_that_count_once() {
        let whole = vec![vec![false, true, true, true], vec![true; 3]];
        let count = |half| part(&whole, half).concat().iter().map(|counts| usize::from(*counts)).collect::<Vec<_>>();
        let mut sum = vec![0; 7];
        for half in [(0, false), (0, true), (1, false), (1, true)] {
            sum.iter_mut().zip(count(half)).for_each(|(sum, counts)| *sum += counts);
        }
        assert_eq!(sum, [0, 1, 1, 1, 1, 1, 1]);
        assert_eq!(count((1, true)), [0, 0, 0, 0, 0, 1, 1]);
    }
}
