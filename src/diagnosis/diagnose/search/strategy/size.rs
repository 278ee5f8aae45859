//! Sizes: derivatives lead to the optimum, unless the base has compensated for the cause.

use super::hold::held;
use super::{Scope, Search, Stop, Task, Values};
use crate::diagnose::likelihood::fit::Point;
use crate::diagnose::likelihood::model::{Model, is_stepped};
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::textbook::with_textbook_values;
use crate::extension::Extension;

/// See [`Search`].
pub struct Size;

impl Search for Size {
    fn starts(&self, task: &Task<'_>) -> Result<Vec<Scope>, Stop> {
        let model = task.model(None)?;
        // A parameter without a neutral value has no start value.
        let open = task.cause.parameters.iter().any(|symbol| symbol.neutral().is_none());
        let sizes = if open { Vec::new() } else { sizes(&model, task.cause) };
        let held = from_textbook_values(task, &model)?;
        Ok(vec![task.scope(model, &sizes, held)])
    }
}

/// Fits of the rest from textbook values with fixed sizes, if the present model may be far off. A base compensates for a missing cause with
/// parameters that are far off, and from there a free size returns to zero.
///
/// # Errors
/// As [`held`].
pub fn from_textbook_values(task: &Task<'_>, model: &Model) -> Result<Vec<Point>, DiagnoseError> {
    let Point { values, noise } = task.present(model);
    if !noise.is_astray() {
        return Ok(Vec::new());
    }
    let values = with_textbook_values(model, &values, task.fastest);
    held(task.setting, model, &Point { values, noise: noise.strong() }, all_together(model, task.cause))
}

/// Sizes to fix for a cause that has nothing but sizes: all of them together, at shares of the way from neutral to the ends.
fn all_together(model: &Model, cause: &Extension) -> Vec<Values> {
    const SHARES: [f64; 3] = [0.06, 0.15, 0.3];
    let positions = model.positions(cause);
    let neutral = |k: usize| model.symbols[k].neutral().filter(|_| !is_stepped(model.symbols[k]));
    let Some(neutral) = positions.iter().map(|&k| neutral(k)).collect::<Option<Vec<f64>>>() else { return Vec::new() };
    let held = |end: f64, share: f64| -> Values {
        let size = |(&k, &neutral): (&usize, &f64)| {
            let (axis, from) = (model.axes[k], model.axes[k].coordinate(neutral));
            (k, axis.value(from + share * (end - from)))
        };
        positions.iter().zip(&neutral).map(size).collect()
    };
    let idle = |size: &Values| size.iter().zip(&neutral).all(|((_, value), neutral)| value == neutral);
    let all = [1.0, 0.0].iter().flat_map(|end| SHARES.map(|share| held(*end, share)));
    all.filter(|size| !idle(size)).collect()
}

/// Start values of a cause's parameters: at every size, all parameters with a neutral value together, and each alone.
#[must_use]
pub fn sizes(model: &Model, cause: &Extension) -> Vec<Values> {
    let positions = model.positions(cause);
    let sized: Vec<(usize, f64)> =
        positions.iter().filter_map(|&k| model.symbols[k].neutral().map(|neutral| (k, neutral))).collect();
    let of = |(k, neutral): &(usize, f64)| -> Vec<(usize, f64)> {
        probes(&model.axes[*k], *neutral).into_iter().map(|value| (*k, value)).collect()
    };
    if let [one] = sized.as_slice() {
        return of(one).into_iter().map(|size| vec![size]).collect();
    }
    let each: Vec<Vec<(usize, f64)>> = sized.iter().map(of).collect();
    let most = each.iter().map(Vec::len).min().unwrap_or(0);
    let together = (0..most).map(|i| each.iter().map(|sizes| sizes[i]).collect());
    together.chain(each.iter().filter_map(|sizes| sizes.get(sizes.len() / 2).map(|size| vec![*size]))).collect()
}

/// Start values on an axis for a parameter that does nothing at `neutral`.
fn probes(axis: &Axis, neutral: f64) -> Vec<f64> {
    let at = axis.coordinate(neutral);
    let shares: &[f64] = if axis.log { &[0.25, 0.45, 0.65] } else { &[0.002, 0.04, 0.15, 0.4] };
    let to = |target: f64| move |share: &f64| axis.value(at + share * (target - at));
    let targets = [0.0, 1.0].into_iter().filter(|target| (target - at).abs() > 0.001);
    let mut found = Vec::new();
    for share in shares {
        found.extend(targets.clone().map(|target| to(target)(share)));
    }
    found
}
