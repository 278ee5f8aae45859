//! Sizes: derivatives lead to the optimum, from a step in which all other parameters move along.

use super::{Scope, Search, Stop, Task, Values, moved};
use crate::diagnose::likelihood::fit::Point;
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::search::observers::softened;
use crate::extension::Extension;

/// Number of small sizes that start beside the present model.
const SMALL: usize = 2;

/// See [`Search`].
pub struct Size;

impl Search for Size {
    fn starts(&self, task: &Task<'_>) -> Result<Vec<Scope>, Stop> {
        let model = task.model(None)?;
        // A parameter without a neutral value has no start value.
        let open = task.cause.parameters.iter().any(|symbol| symbol.neutral().is_none());
        let sizes = if open { Vec::new() } else { sizes(&model, task.cause) };
        let present = task.current.fit.point.noise;
        let rests = task.rests(&model, softened(&present, 1.0).unwrap_or(present));
        // A promise need not hold.
        let small = |size: &Values| Point { values: moved(&model, &rests[0].values, size), ..rests[0] };
        let mut starts: Vec<Point> = sizes.iter().take(SMALL).map(small).collect();
        for rest in &rests {
            let found = task.promised(&model, rest, &sizes, (0, 1))?;
            starts.extend(found.into_iter().map(|(_, values)| Point { values, ..*rest }));
        }
        Ok(vec![Scope { model, starts, held: Vec::new(), alone: false, promise: [0.0; 2] }])
    }
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
