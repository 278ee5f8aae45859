//! A limit that clips a quantity: a base imitates one that is reached often.

use super::hold::held;
use super::size::sizes;
use super::{Scope, Search, Stop, Task, Values};
use crate::diagnose::likelihood::fit::{Point, log_likelihoods};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::question::DiagnoseError;

/// Limits that are fixed while the rest moves, as shares of the axis from the neutral end. A limit that is reached worsens the fit until
/// the rest has moved, and one that is not reached has no slope.
const HELD: [f64; 7] = [0.15, 0.22, 0.29, 0.36, 0.43, 0.52, 0.63];
/// Number of limits in a dense row.
const ROW: usize = 80;

/// See [`Search`].
pub struct Limit;

impl Search for Limit {
    fn starts(&self, task: &Task<'_>) -> Result<Vec<Scope>, Stop> {
        let model = task.model(None)?;
        let limit = task.only(&model);
        let limits: Vec<Values> = HELD.iter().map(|size| vec![(limit, model.axes[limit].value(1.0 - size))]).collect();
        let start = task.present(&model);
        let mut points = vec![likeliest(task, &model, limit)?];
        points.extend(held(task.setting, &model, &Point { noise: start.noise.strong(), ..start }, limits)?);
        let sizes = sizes(&model, task.cause);
        Ok(vec![task.scope(model, &sizes, points)])
    }
}

/// The likeliest of a dense row of limits: for a limit that is reached once or twice, the base is otherwise right.
fn likeliest(task: &Task<'_>, model: &Model, limit: usize) -> Result<Point, DiagnoseError> {
    let (present, axis) = (task.present(model), model.axes[limit]);
    let at = |i: usize| {
        let mut point = present.clone();
        point.values[limit] = axis.value((i as f64 + 0.5) / ROW as f64);
        point
    };
    let row: Vec<Point> = (0..ROW).map(at).collect();
    let likelihoods = log_likelihoods(model, &model.axes, &task.setting.whole, &row)?;
    let likeliest = (0..ROW).max_by(|&a, &b| likelihoods[a].total_cmp(&likelihoods[b])).expect("a row");
    Ok(row[likeliest].clone())
}
