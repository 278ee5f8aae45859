//! Selects the values that are worth a fit: simulates each once on top of a model, and keeps the likeliest.

use super::{Values, moved};
use crate::diagnose::likelihood::fit::{Point, log_likelihoods};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::Context;
use crate::diagnose::search::observers::softened;

/// Two points are the same if all their times are closer than this \[s\] and all their sizes closer than this share.
const SAME: (f64, f64) = (6.0, 0.03);

/// The likeliest points under the present observer and under a nearly free one, without a fit, an equal number of each and no two nearly
/// the same; the present observer may hide their effect in its missing acceleration. With them, the largest log-likelihood under each.
///
/// # Errors
/// As [`log_likelihoods`].
pub fn likeliest(
    setting: &Context<'_>,
    at: &Point,
    model: &Model,
    values: Vec<Values>,
    most: usize,
) -> Result<(Vec<Values>, [f64; 2]), DiagnoseError> {
    let present = softened(&at.noise, 1.0).unwrap_or(at.noise);
    let mut kept: Vec<Values> = Vec::new();
    let mut largest = [f64::NEG_INFINITY; 2];
    for (turn, noise) in [present, present.freer()].into_iter().enumerate() {
        let point = |by: &Values| Point { values: moved(model, &at.values, by), noise };
        let points: Vec<Point> = values.iter().map(point).collect();
        let found = log_likelihoods(model, &model.axes, &setting.whole, &points)?;
        let order = highest(&found, 0, found.len());
        largest[turn] = order.first().map_or(f64::NEG_INFINITY, |&i| found[i]);
        for i in order {
            if kept.len() == most * (turn + 1) {
                break;
            }
            if kept.iter().all(|other| !same(model, other, &values[i])) {
                kept.push(values[i].clone());
            }
        }
    }
    Ok((kept, largest))
}

fn same(model: &Model, a: &Values, b: &Values) -> bool {
    let close = |((k, a), (_, b)): (&(usize, f64), &(usize, f64))| {
        let within = if model.symbols[*k].is_time() { SAME.0 } else { SAME.1 * b.abs() };
        (a - b).abs() < within
    };
    a.iter().zip(b).all(close)
}

/// Positions of the highest finite values, the highest first, none closer to another than `apart`.
#[must_use]
pub fn highest(values: &[f64], apart: usize, most: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_finite()).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]).then(a.cmp(&b)));
    let mut taken: Vec<usize> = Vec::new();
    for i in order {
        if taken.len() < most && taken.iter().all(|t| t.abs_diff(i) >= apart) {
            taken.push(i);
        }
    }
    taken
}
