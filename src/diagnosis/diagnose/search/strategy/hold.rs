//! Fits with a fixed size, for causes that a base imitates.

use super::Values;
use crate::diagnose::likelihood::fit::{Plan, Point, fit_each};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::Context;

/// Number of fixed sizes whose fits continue with the size free.
const FOLLOWED: usize = 2;
/// Iterations with a fixed size, for all sizes and then for the likelier half.
const HOLDING: Plan = Plan { select: usize::MAX, rough: 2, keep: 1, fine: 2, tolerance: 0.1, least: [0.0; 2] };

/// The likeliest fits from a start, each with one of several sizes fixed.
///
/// # Errors
/// As [`fit_each`].
pub fn held(
    setting: &Context<'_>,
    model: &Model,
    start: &Point,
    sizes: Vec<Values>,
) -> Result<Vec<Point>, DiagnoseError> {
    follow(setting, model, sizes.into_iter().map(|size| holding(model, start, &size)).collect())
}

/// The axes and the start with fixed sizes.
#[must_use]
pub fn holding(model: &Model, start: &Point, size: &Values) -> (Vec<Axis>, Point) {
    let (mut axes, mut start) = (model.axes.clone(), start.clone());
    for &(k, value) in size {
        start.values[k] = value;
        axes[k] = Axis::held(value);
    }
    (axes, start)
}

/// The likeliest of starts with separate axes, after some iterations.
///
/// # Errors
/// As [`fit_each`].
pub fn follow(
    setting: &Context<'_>,
    model: &Model,
    starts: Vec<(Vec<Axis>, Point)>,
) -> Result<Vec<Point>, DiagnoseError> {
    let plan = Plan { keep: starts.len().div_ceil(2).max(FOLLOWED), ..HOLDING };
    let found = fit_each(model, &setting.whole, &starts, plan)?;
    Ok(found.into_iter().take(FOLLOWED).map(|fit| fit.point).collect())
}
