//! Which of many hints are worth a fit: each is simulated once on top of a model, and the likeliest are kept.

use super::candidate::{Candidate, Setting};
use super::fit::{Point, log_likelihoods};
use super::model::Model;
use super::start::Hint;
use super::verdict::DiagnoseError;
use crate::extension::Extension;
use crate::symbols::Symbol;

/// Relative changes of a size at which an event's time is scanned.
const SCAN: f64 = 0.1;
/// Two hints are the same if all their times are closer than this \[s\] and all their sizes closer than this share.
const SAME: (f64, f64) = (6.0, 0.03);

/// The likeliest of many hints. Hints whose size is that of nothing are times to be scanned: the likelihood at a little more and
/// a little less tells, by the parabola through the three, at which times the size would gain most.
///
/// # Errors
/// As [`log_likelihoods`].
pub fn scanned(
    setting: &Setting<'_>,
    current: &Candidate,
    model: &mut Model,
    cause: &'static Extension,
    hints: Vec<Hint>,
    most: usize,
) -> Result<Vec<Hint>, DiagnoseError> {
    let idle = |hint: &Hint| hint.iter().any(|(symbol, value)| symbol.neutral() == Some(*value));
    let Some(size) = cause.parameters.iter().copied().find(|symbol| symbol.neutral().is_some()) else {
        return Ok(hints);
    };
    if hints.len() <= most {
        return Ok(hints);
    }
    if !hints.iter().all(idle) {
        return likeliest(current, model, setting, hints, most);
    }
    let neutral = size.neutral().unwrap_or(0.0);
    let values = model.adopt(&current.model, &current.fit.point.values);
    let mut points = vec![Point { values: values.clone(), noise: current.fit.point.noise }];
    for hint in &hints {
        for change in [-SCAN, SCAN] {
            let mut moved = values.clone();
            for (symbol, value) in hint {
                let k = model.position(*symbol).expect("a parameter of this cause");
                moved[k] = if *symbol == size { neutral + change } else { *value };
            }
            points.push(Point { values: moved, noise: current.fit.point.noise });
        }
    }
    let axes = model.axes.clone();
    let found = log_likelihoods(model, &axes, &setting.whole, &points)?;
    let gain = |i: usize| -> (f64, f64) {
        let (less, more) = (found[1 + 2 * i] - found[0], found[2 + 2 * i] - found[0]);
        let (slope, bend) = (0.5 * (more - less), -(more + less));
        // Curvature below 0 or none: the larger of the two trials.
        let step = if bend > 1e-9 { (slope / bend).clamp(-3.0, 3.0) } else { slope.signum() };
        (slope * step - 0.5 * bend.max(0.0) * step * step, step * SCAN)
    };
    let mut order: Vec<((f64, f64), usize)> = (0..hints.len()).map(|i| (gain(i), i)).collect();
    order.retain(|((gain, _), _)| gain.is_finite());
    order.sort_by(|a, b| b.0.0.total_cmp(&a.0.0));
    let chosen = order.into_iter().take(most).map(|((_, step), i)| {
        hints[i]
            .iter()
            .map(|(symbol, value)| (*symbol, if *symbol == size { neutral + step } else { *value }))
            .collect()
    });
    Ok(chosen.collect())
}

/// The likeliest hints as they are, no two of them about the same.
fn likeliest(
    current: &Candidate,
    model: &mut Model,
    setting: &Setting<'_>,
    hints: Vec<Hint>,
    most: usize,
) -> Result<Vec<Hint>, DiagnoseError> {
    let values = model.adopt(&current.model, &current.fit.point.values);
    let point = |hint: &Hint| {
        let mut moved = values.clone();
        for (symbol, value) in hint {
            let k = model.position(*symbol).expect("a parameter of this cause");
            moved[k] = value.clamp(model.axes[k].lower, model.axes[k].upper);
        }
        Point { values: moved, noise: current.fit.point.noise }
    };
    let points: Vec<Point> = hints.iter().map(point).collect();
    let axes = model.axes.clone();
    let found = log_likelihoods(model, &axes, &setting.whole, &points)?;
    let mut order: Vec<usize> = (0..hints.len()).filter(|&i| found[i].is_finite()).collect();
    order.sort_by(|&a, &b| found[b].total_cmp(&found[a]).then(a.cmp(&b)));
    let mut kept: Vec<&Hint> = Vec::new();
    for i in order {
        if kept.iter().all(|hint| !same(hint, &hints[i])) {
            kept.push(&hints[i]);
        }
        if kept.len() == most {
            break;
        }
    }
    Ok(kept.into_iter().cloned().collect())
}

fn same(a: &Hint, b: &Hint) -> bool {
    let close = |((symbol, a), (_, b)): (&(Symbol, f64), &(Symbol, f64))| {
        let within = if symbol.is_time() { SAME.0 } else { SAME.1 * b.abs() };
        (a - b).abs() < within
    };
    a.iter().zip(b).all(close)
}
