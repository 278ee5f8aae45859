//! A search without derivatives, for a size on which innovations depend in jumps: everything has to fit together before such a size
//! is seen to be right, and no derivative of a rugged likelihood leads there.

use super::candidate::{Candidate, Setting};
use super::fit::{Plan, Point, log_likelihoods};
use super::likelihood::Mask;
use super::model::Model;
use super::space::Axis;
use super::streams;
use super::verdict::DiagnoseError;
use crate::extension::Extension;
use crate::optimize::{Descent, DescentSettings, Merit, Optimizer, Origin, SearchBox, Start};
use crate::symbols::SearchKind;
use std::sync::atomic::Ordering;

/// First steps of the descents in turn, shares of the ranges of the parameters; the noise is fitted again after each.
const STEPS: [f64; 5] = [0.06, 0.015, 0.015, 0.015, 0.015];
/// The third and those after it follow one that gained this much \[nats\].
const WORTH: f64 = 2.0;
/// Evaluations and population of a descent.
const DESCENT: (u64, usize) = (3000, 50);

/// True for a cause with a size on which innovations depend in jumps.
#[must_use]
pub fn is_rugged(cause: &Extension) -> bool {
    cause.search() == SearchKind::Steps
}

/// The fit moved to the best that CMA-ES finds around it, and refined there.
///
/// # Errors
/// As [`Candidate::fitted`].
pub fn polished(setting: &Setting<'_>, mut found: Candidate, plan: Plan) -> Result<Candidate, DiagnoseError> {
    for (turn, step) in STEPS.into_iter().enumerate() {
        let Candidate { variant, causes, model, fit } = found;
        let (axes, at) = (model.axes.clone(), fit.point.clone());
        let before = model.simulations();
        let descended = descended(setting, &model, &axes, &setting.whole, &at, step, turn as u64)?;
        setting.simulations.fetch_add(model.simulations() - before, Ordering::Relaxed);
        let starts: Vec<Point> = std::iter::once(at).chain(descended).collect();
        let plan = Plan { select: starts.len(), kinds: 1, rough: 0, keep: starts.len(), ..plan };
        let again = Candidate::fitted(setting, variant, &causes, model, &starts, plan)?;
        found = again.expect("a start that has run runs again");
        if turn > 0 && found.fit.log_likelihood < fit.log_likelihood + WORTH {
            break;
        }
    }
    Ok(found)
}

/// The best that CMA-ES finds around a point along the axes that are not fixed, with the noise as it is, in what the masks show; its first
/// step as a share of the ranges. Each `turn` draws numbers of its own. `None` if no run comes to its end.
///
/// # Errors
/// As [`log_likelihoods`].
pub fn descended(
    setting: &Setting<'_>,
    model: &Model,
    axes: &[Axis],
    masks: &[Mask],
    at: &Point,
    step: f64,
    turn: u64,
) -> Result<Option<Point>, DiagnoseError> {
    let free: Vec<usize> = (0..axes.len()).filter(|&k| !axes[k].is_fixed()).collect();
    let point = |coordinates: &[f64]| {
        let mut values = at.values.clone();
        free.iter().zip(coordinates).for_each(|(&k, u)| values[k] = axes[k].value(*u));
        Point { values, noise: at.noise }
    };
    let space = SearchBox { lower: vec![0.0; free.len()], upper: vec![1.0; free.len()] };
    let middle = free.iter().map(|&k| axes[k].coordinate(at.values[k])).collect();
    let settings = DescentSettings { population: DESCENT.1, evaluations: DESCENT.0, tolerance: 1e-7, floor: 0.0 };
    let origin = Origin { generation: 1000 * turn, ..Origin::new(setting.question.seed, streams::DESCENT) };
    let mut descent = Descent::new(space, Start::Round { middle, step }, settings, origin);
    while descent.ended().is_none() {
        let points: Vec<Point> = descent.ask().iter().map(|coordinates| point(coordinates)).collect();
        let merit = |likelihood: f64| match likelihood.is_finite() {
            true => Merit::Feasible(-likelihood),
            false => Merit::Infeasible { survived: 0 },
        };
        let likelihoods = log_likelihoods(model, axes, masks, &points)?;
        descent.tell(&likelihoods.into_iter().map(merit).collect::<Vec<_>>());
    }
    let best = descent.best().filter(|best| matches!(best.merit, Merit::Feasible(_)));
    Ok(best.map(|best| point(&best.point)))
}
