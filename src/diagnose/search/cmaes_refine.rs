//! A search without derivatives, for a size on which innovations depend in jumps: everything has to fit together before such a size
//! is seen to be right, and no derivative of a rugged likelihood leads there.

use super::fitted_model::{Context, FittedModel};
use crate::diagnose::likelihood::descent::descended;
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::question::DiagnoseError;
use std::sync::atomic::Ordering;

/// First steps of the descents in turn, shares of the ranges of the parameters; the noise is fitted again after each.
const STEPS: [f64; 5] = [0.06, 0.015, 0.015, 0.015, 0.015];
/// The third and those after it follow one that gained this much \[nats\].
const WORTH: f64 = 2.0;
/// The fit moved to the best that CMA-ES finds around it, and refined there.
///
/// # Errors
/// As [`FittedModel::fitted`].
pub fn polished(setting: &Context<'_>, mut found: FittedModel, plan: Plan) -> Result<FittedModel, DiagnoseError> {
    for (turn, step) in STEPS.into_iter().enumerate() {
        let FittedModel { variant, causes, model, fit } = found;
        let (axes, at) = (model.axes.clone(), fit.point.clone());
        let before = model.simulations();
        let descended = descended(&model, &axes, &setting.whole, &at, step, (setting.question.seed, turn as u64))?;
        setting.simulations.fetch_add(model.simulations() - before, Ordering::Relaxed);
        let starts: Vec<Point> = std::iter::once(at).chain(descended).collect();
        let plan = Plan { select: starts.len(), kinds: 1, rough: 0, keep: starts.len(), ..plan };
        let again = FittedModel::fitted(setting, variant, &causes, model, &starts, plan)?;
        found = again.expect("a start that has run runs again");
        if turn > 0 && found.fit.log_likelihood < fit.log_likelihood + WORTH {
            break;
        }
    }
    Ok(found)
}
