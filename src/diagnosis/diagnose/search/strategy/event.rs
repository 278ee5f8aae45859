//! An effect that begins at a time. A base compensates for a part of it, so all other parameters must move with each time that is tried.

use super::scan::highest;
use super::{Scope, Search, Stop, Task, moved};
use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::fit::{Point, profiled};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::FittedModel;
use crate::diagnose::search::observers::softened;
use crate::diagnose::search::textbook::with_textbook_values;

/// Distance of the times in a scan \[s\].
const APART_S: f64 = 8.0;
/// Change of the size in a scan of times, in the unit of the size.
const SCAN: f64 = 0.1;
/// Factor on the noise of ordinary sensors, so that the likelihood has a slope even at a time that is off by seconds.
const SMOOTHER: f64 = 10.0;

/// See [`Search`].
pub struct AtATime;

impl Search for AtATime {
    fn starts(&self, task: &Task<'_>) -> Result<Vec<Scope>, Stop> {
        let drives = task.setting.question.train;
        let mut scopes = Vec::new();
        for drive in acting(drives) {
            let model = task.model(drive)?;
            let positions = model.positions(task.cause);
            let Some((size, time)) = positions
                .iter()
                .find(|&&k| model.symbols[k].neutral().is_some())
                .zip(positions.iter().find(|&&k| model.symbols[k].is_time()))
            else {
                return Ok(Vec::new());
            };
            // Times for all drives are those of the first one.
            let times = times(&drives[drive.unwrap_or(0)]);
            scopes.push(timed(task, model, (*size, *time), &times)?);
        }
        Ok(scopes)
    }

    fn refine(&self, task: &Task<'_>, scope: Scope) -> Result<Option<FittedModel>, DiagnoseError> {
        task.fitted(scope, SMOOTHER)
    }
}

/// The possible scopes of an event: one drive, or the same time in all files. If the clock continues from file to file, only one drive has
/// the time, and one scope is enough.
#[must_use]
pub fn acting(drives: &[Drive]) -> Vec<Option<usize>> {
    let mut one: Vec<Option<usize>> = (0..drives.len()).map(Some).collect();
    if overlap(drives) || drives.len() == 1 {
        one.push(None);
    }
    one
}

fn overlap(drives: &[Drive]) -> bool {
    let span = |d: &Drive| (d.trajectory.t[0], d.trajectory.t[d.samples() - 1]);
    let mut spans: Vec<(f64, f64)> = drives.iter().map(span).collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    spans.windows(2).any(|w| w[1].0 < w[0].1)
}

fn times(drive: &Drive) -> Vec<f64> {
    let (first, last) = (drive.trajectory.t[0], drive.trajectory.t[drive.samples() - 1]);
    let count = ((last - first) / APART_S).floor().max(2.0) as usize;
    (0..count).map(|i| first + (last - first) * (i as f64 + 0.5) / count as f64).collect()
}

/// Starts at the times at which a size would gain most, under the present observer and under a nearly free one: the first hides much of a
/// large effect in its missing acceleration, and the second hardly shows a small one. Each start has the observer that found it, and a
/// second one textbook values of free driving with a strong observer, because one search may continue where another stops.
fn timed(task: &Task<'_>, model: Model, (size, time): (usize, usize), times: &[f64]) -> Result<Scope, DiagnoseError> {
    let Point { values, noise } = task.present(&model);
    let neutral = model.symbols[size].neutral().unwrap_or_default();
    let at = |t: f64, by: f64| moved(&model, &values, &vec![(size, neutral + by), (time, t)]);
    let changed: Vec<Vec<f64>> = times.iter().map(|t| at(*t, SCAN)).collect();
    let own = |k: usize| k == size || k == time;
    let axis = |k: usize| if own(k) { Axis::linear(values[k], values[k]) } else { model.axes[k] };
    let axes: Vec<Axis> = (0..values.len()).map(axis).collect();
    let present = softened(&noise, 1.0).unwrap_or(noise);
    let free = softened(&present, SMOOTHER).unwrap_or(present).freer();
    let (mut starts, mut promise) = (Vec::new(), [0.0; 2]);
    for (noise, promise) in [present, free].into_iter().zip(&mut promise) {
        let from = Point { values: values.clone(), noise };
        let steps = profiled(&model, &axes, &task.setting.whole, &from, &changed)?;
        let gains: Vec<f64> = steps.iter().map(|step| if step.gain > 0.0 { step.gain } else { f64::NAN }).collect();
        // Neighbours are the same event.
        for (rank, i) in highest(&gains, 2, task.budget.hints).into_iter().enumerate() {
            if rank == 0 {
                *promise = gains[i];
            }
            let sized = at(times[i], SCAN * steps[i].share);
            let values = (0..sized.len()).map(|k| if own(k) { sized[k] } else { steps[i].values[k] }).collect();
            starts.push(Point { values, noise });
            let textbook = with_textbook_values(&model, &sized, task.fastest);
            starts.push(Point { values: textbook, noise: present.strong() });
        }
    }
    Ok(Scope { model, starts, held: Vec::new(), alone: false, promise })
}
