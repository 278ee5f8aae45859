//! An effect that begins at a time. A base compensates for a part of it, so all other parameters must move with each time that is tried.

use super::{Scope, Search, Stop, Task, Values, moved};
use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::fit::Point;
use crate::diagnose::likelihood::model::Model;
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
    let sized = model.symbols[size].neutral().unwrap_or_default() + SCAN;
    let changes: Vec<Values> = times.iter().map(|t| vec![(size, sized), (time, *t)]).collect();
    let present = softened(&noise, 1.0).unwrap_or(noise);
    let free = softened(&present, SMOOTHER).unwrap_or(present).freer();
    let (mut starts, mut promise) = (Vec::new(), [0.0; 2]);
    for (noise, promise) in [present, free].into_iter().zip(&mut promise) {
        let from = Point { values: values.clone(), noise };
        // Neighbours are the same event.
        let found = task.promised(&model, &from, &changes, (2, task.budget.hints))?;
        *promise = found.first().map_or(0.0, |(gain, _)| *gain);
        for (_, there) in found {
            let event = moved(&model, &values, &vec![(size, there[size]), (time, there[time])]);
            let textbook = with_textbook_values(&model, &event, task.fastest);
            starts.push(Point { values: there, noise });
            starts.push(Point { values: textbook, noise: present.strong() });
        }
    }
    Ok(Scope { model, starts, held: Vec::new(), alone: false, promise })
}
