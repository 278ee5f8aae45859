//! Which of many hints are worth a fit: each is simulated once on top of a model, and the likeliest are kept.

use super::fitted_model::{Context, FittedModel};
use super::start::{Hint, softened};
use super::textbook::with_textbook_values;
use crate::diagnose::likelihood::fit::{Point, log_likelihoods, profiled};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::question::DiagnoseError;
use crate::symbols::Symbol;

/// Change of a size with which an event's time is scanned.
const SCAN: f64 = 0.1;
/// Two hints are the same if all their times are closer than this \[s\] and all their sizes closer than this share.
const SAME: (f64, f64) = (6.0, 0.03);

/// True for hints whose size is that of nothing: times to be scanned.
#[must_use]
pub fn are_idle(hints: &[Hint]) -> bool {
    let idle = |hint: &Hint| hint.iter().any(|(symbol, value)| symbol.neutral() == Some(*value));
    !hints.is_empty() && hints.iter().all(idle)
}

/// The likeliest of many hints on top of a point.
///
/// # Errors
/// As [`log_likelihoods`].
pub fn scanned(
    setting: &Context<'_>,
    at: &Point,
    model: &Model,
    hints: Vec<Hint>,
    most: usize,
) -> Result<Vec<Hint>, DiagnoseError> {
    if hints.len() <= most { Ok(hints) } else { Ok(likeliest(at, model, setting, hints, most)?.0) }
}

/// Starts at the times at which a size would gain most with everything else moving with it, under the present observer and under a
/// nearly free one: the first hides much of a large effect in its missing acceleration, the second sees a small one badly. Each
/// under the observer that found it, and with textbook values of free driving under a strong one: where one search stops, another goes on.
/// `fastest` is the largest speed of the follower \[m/s\]. With the starts, the largest gain promised under either observer \[nats\].
///
/// # Errors
/// As [`profiled`].
pub fn timed(
    setting: &Context<'_>,
    current: &FittedModel,
    model: &Model,
    hints: &[Hint],
    most: usize,
    fastest: f64,
) -> Result<(Vec<Point>, [f64; 2]), DiagnoseError> {
    let values = model.adopt(&current.model, &current.fit.point.values);
    let bounds = model.axes.clone();
    let own: Vec<usize> = hints[0].iter().filter_map(|(symbol, _)| model.position(*symbol)).collect();
    // The values of a hint, and of those the one that says how large.
    let at = |hint: &Hint, size: f64| {
        let mut values = values.clone();
        for ((symbol, value), &k) in hint.iter().zip(&own) {
            let sized = symbol.neutral().filter(|neutral| neutral == value).map(|neutral| neutral + size);
            values[k] = sized.unwrap_or(*value).clamp(bounds[k].lower, bounds[k].upper);
        }
        values
    };
    let changed: Vec<Vec<f64>> = hints.iter().map(|hint| at(hint, SCAN)).collect();
    let fixed = |k: usize| if own.contains(&k) { Axis::linear(values[k], values[k]) } else { bounds[k] };
    let axes: Vec<Axis> = (0..values.len()).map(fixed).collect();
    let present = compared(&current.fit.point.noise);
    let free = softened(&present, true).unwrap_or(present);
    let free = free.freer();
    let strong = present.strong();
    let (mut starts, mut gains) = (Vec::new(), [0.0; 2]);
    for (noise, gain) in [present, free].into_iter().zip(&mut gains) {
        let from = Point { values: values.clone(), noise };
        let steps = profiled(model, &axes, &setting.whole, &from, &changed)?;
        let mut order: Vec<usize> = (0..hints.len()).filter(|&i| steps[i].gain > 0.0).collect();
        order.sort_by(|&a, &b| steps[b].gain.total_cmp(&steps[a].gain).then(a.cmp(&b)));
        *gain = order.first().map_or(0.0, |&i| steps[i].gain);
        // Neighbours are the same event.
        let mut kept: Vec<usize> = Vec::new();
        for i in order {
            if kept.len() < most && kept.iter().all(|k| k.abs_diff(i) > 1) {
                kept.push(i);
            }
        }
        for i in kept {
            let sized = at(&hints[i], SCAN * steps[i].share);
            let values = (0..sized.len()).map(|k| if own.contains(&k) { sized[k] } else { steps[i].values[k] });
            let values: Vec<f64> = values.collect();
            starts.push(Point { values, noise });
            let values = with_textbook_values(model, &sized, fastest);
            starts.push(Point { values, noise: strong });
        }
    }
    Ok((starts, gains))
}

/// The likeliest hints as they are under the present observer and under a nearly free one, so many of each, no two of them about the
/// same: the present one may hide in its missing acceleration what a hint is about. With them, the largest log-likelihood under each.
///
/// # Errors
/// As [`log_likelihoods`].
pub fn likeliest(
    at: &Point,
    model: &Model,
    setting: &Context<'_>,
    hints: Vec<Hint>,
    most: usize,
) -> Result<(Vec<Hint>, [f64; 2]), DiagnoseError> {
    let present = compared(&at.noise);
    let free = present.freer();
    let axes = model.axes.clone();
    let mut kept: Vec<Hint> = Vec::new();
    let mut largest = [f64::NEG_INFINITY; 2];
    for (turn, noise) in [present, free].into_iter().enumerate() {
        let point = |hint: &Hint| Point { values: moved(model, &at.values, hint), noise };
        let points: Vec<Point> = hints.iter().map(point).collect();
        let found = log_likelihoods(model, &axes, &setting.whole, &points)?;
        let mut order: Vec<usize> = (0..hints.len()).filter(|&i| found[i].is_finite()).collect();
        order.sort_by(|&a, &b| found[b].total_cmp(&found[a]).then(a.cmp(&b)));
        largest[turn] = order.first().map_or(f64::NEG_INFINITY, |&i| found[i]);
        for i in order {
            if kept.len() == most * (turn + 1) {
                break;
            }
            if kept.iter().all(|hint| !same(hint, &hints[i])) {
                kept.push(hints[i].clone());
            }
        }
    }
    Ok((kept, largest))
}

/// A stretch whose two ends and whose size are moved as long as that makes it likelier, in ever smaller steps: neither has a derivative
/// that shows the way while the other is off.
///
/// # Errors
/// As [`log_likelihoods`].
pub fn walked(setting: &Context<'_>, at: &Point, model: &Model, mut hint: Hint) -> Result<Hint, DiagnoseError> {
    /// Steps of the ends \[s\]; of the size a tenth of each.
    const STEPS: [f64; 7] = [16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25];
    /// Most moves per step.
    const MOVES: usize = 8;
    let times: Vec<usize> = (0..hint.len()).filter(|&i| hint[i].0.is_time()).collect();
    let (&[begin, length], Some(size)) = (times.as_slice(), (0..hint.len()).find(|&i| !hint[i].0.is_time())) else {
        return Ok(hint);
    };
    let axes = model.axes.clone();
    for step in STEPS {
        for _ in 0..MOVES {
            let mut around = vec![hint.clone()];
            for (earlier, later, larger) in [
                (1.0, 0.0, 0.0),
                (-1.0, 0.0, 0.0),
                (0.0, 1.0, 0.0),
                (0.0, -1.0, 0.0),
                (1.0, 1.0, 0.0),
                (-1.0, 1.0, 0.0),
                (1.0, -1.0, 0.0),
                (-1.0, -1.0, 0.0),
                (0.0, 0.0, 0.1),
                (0.0, 0.0, -0.1),
            ] {
                let mut other = hint.clone();
                other[begin].1 -= step * earlier;
                other[length].1 += step * (earlier + later);
                other[size].1 += step * larger;
                if other[length].1 > 0.0 {
                    around.push(other);
                }
            }
            let points: Vec<Point> =
                around.iter().map(|hint| Point { values: moved(model, &at.values, hint), noise: at.noise }).collect();
            let found = log_likelihoods(model, &axes, &setting.whole, &points)?;
            let best = (0..found.len()).max_by(|&a, &b| found[a].total_cmp(&found[b]).then(b.cmp(&a)));
            match best {
                Some(best) if best > 0 && found[best].is_finite() => hint = around.swap_remove(best),
                _ => break,
            }
        }
    }
    Ok(hint)
}

/// Values with those of a hint in their place.
#[must_use]
pub fn moved(model: &Model, values: &[f64], hint: &Hint) -> Vec<f64> {
    let mut moved = values.to_vec();
    for (symbol, value) in hint {
        let k = model.position(*symbol).expect("a parameter of this cause");
        moved[k] = value.clamp(model.axes[k].lower, model.axes[k].upper);
    }
    moved
}

/// The noise that hints are compared with.
fn compared(noise: &Noise) -> Noise {
    softened(noise, false).unwrap_or(*noise)
}

fn same(a: &Hint, b: &Hint) -> bool {
    let close = |((symbol, a), (_, b)): (&(Symbol, f64), &(Symbol, f64))| {
        let within = if symbol.is_time() { SAME.0 } else { SAME.1 * b.abs() };
        (a - b).abs() < within
    };
    a.iter().zip(b).all(close)
}
