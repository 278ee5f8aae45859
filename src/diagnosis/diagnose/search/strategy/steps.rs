//! A size on which innovations depend in jumps: derivatives do not lead to it, and a search without derivatives moves the rest.

use super::hold::{follow, holding};
use super::scan::{highest, likeliest};
use super::{Scope, Search, Stop, Task, Values};
use crate::diagnose::likelihood::descent::descended;
use crate::diagnose::likelihood::fit::{Point, log_likelihoods};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::FittedModel;
use crate::statistics::upper_median;

/// Factor on the noise of ordinary sensors.
const SMOOTHER: f64 = 4.0;
/// Number of sizes in a dense row in equal ratios, and the smallest as a share of the largest.
const ROW: (usize, f64) = (240, 0.02);
/// Number of sizes that are fixed, and their smallest distance in the row.
const STAND_OUT: (usize, usize) = (2, 4);
/// Number of neighbours on each side that a size has to stand out from.
const AROUND: usize = 12;
/// Smallest height of a size above its neighbours \[nats\], and its largest loss against the model without it, as a multiple of the height.
/// Steps of a real command stand out by hundreds of nats and lose less than that; by chance, a size stands out by tens and loses more. If
/// the base is far off, only the height counts.
const HIGH: f64 = 25.0;
const HIGH_ASTRAY: f64 = 100.0;
const DEEP: f64 = 2.0;
/// First step of the search with a fixed size, as a share of the ranges, and the number of its first random stream.
const DESCENT: (f64, u64) = (0.03, 100);

/// See [`Search`].
pub struct Steps;

impl Search for Steps {
    fn starts(&self, task: &Task<'_>) -> Result<Vec<Scope>, Stop> {
        let model = task.model(None)?;
        let step = task.only(&model);
        let row = row(model.axes[step].upper);
        let sizes: Vec<Values> = row.iter().map(|size| vec![(step, *size)]).collect();
        let present = task.present(&model);
        let held = held(task, &model, &present, &sizes)?;
        let (likeliest, _) = likeliest(task.setting, &present, &model, sizes, task.budget.hints)?;
        Ok(vec![task.scope(model, &likeliest, held)])
    }

    fn refine(&self, task: &Task<'_>, scope: Scope) -> Result<Option<FittedModel>, DiagnoseError> {
        task.fitted(scope, SMOOTHER)
    }
}

/// A dense row of sizes up to the largest, in equal ratios.
fn row(largest: f64) -> Vec<f64> {
    let (count, smallest) = ROW;
    (0..count).map(|i| largest * smallest.powf(i as f64 / (count - 1) as f64)).collect()
}

/// Fits of the rest at fixed sizes that are likelier than their neighbours. If the base is slightly off, a larger size makes the fit worse,
/// so the likeliest size is almost zero, but the right one stands out. If no size stands out, there are no steps, and no search without
/// derivatives follows.
fn held(task: &Task<'_>, model: &Model, present: &Point, sizes: &[Values]) -> Result<Vec<Point>, DiagnoseError> {
    let setting = task.setting;
    let row: Vec<Point> = sizes.iter().map(|size| holding(model, present, size).1).collect();
    let likelihoods = log_likelihoods(model, &model.axes, &setting.whole, &row)?;
    let heights = heights(&likelihoods);
    let astray = present.noise.is_astray();
    let promises = |i: &usize| promises(heights[*i], task.current.fit.log_likelihood - likelihoods[*i], astray);
    let stand_out = highest(&heights, STAND_OUT.1, STAND_OUT.0).into_iter().filter(promises);
    let descend = |(turn, i): (usize, usize)| {
        let (axes, start) = holding(model, present, &sizes[i]);
        let draws = (setting.question.seed, DESCENT.1 + turn as u64);
        let there = descended(model, &axes, &setting.whole, &start, DESCENT.0, draws)?;
        Ok((axes, there.unwrap_or(start)))
    };
    follow(setting, model, stand_out.enumerate().map(descend).collect::<Result<_, DiagnoseError>>()?)
}

/// True for a size that stands out enough, relative to its loss.
fn promises(height: f64, loss: f64, astray: bool) -> bool {
    if astray { height > HIGH_ASTRAY } else { height > HIGH && loss < DEEP * height }
}

/// Height of a row at each position above the median around it.
fn heights(row: &[f64]) -> Vec<f64> {
    let height = |i: usize| {
        let around = &row[i.saturating_sub(AROUND)..(i + AROUND + 1).min(row.len())];
        row[i] - upper_median(around.iter().copied()).expect("itself at least")
    };
    (0..row.len()).map(height).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planted_steps_promise_and_others_do_not() {
        for (height, loss, astray) in [(300.0, 180.0, false), (300.0, 15_000.0, true)] {
            assert!(promises(height, loss, astray), "planted: {height} nats");
        }
        for (height, loss, astray) in [(25.5, 102.0, false), (20.0, 0.0, false), (77.0, 0.0, true), (52.0, 0.0, true)] {
            assert!(!promises(height, loss, astray), "not there: {height} nats");
        }
    }

    #[test]
    fn what_stands_out_is_not_what_is_largest() {
        // Falls to -1000; at 60 it is 300 above its neighbours.
        let row: Vec<f64> = (0..100).map(|i| f64::from(-10 * i + if i == 60 { 300 } else { 0 })).collect();
        assert_eq!(highest(&heights(&row), STAND_OUT.1, 1), [60]);
        let mut broken = row.clone();
        broken[60] = f64::NEG_INFINITY;
        assert!(!highest(&heights(&broken), STAND_OUT.1, 100).contains(&60));
    }
}
