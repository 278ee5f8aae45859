//! Structure that a model leaves although the search tried all causes: flexible terms and single instants. They show where the model errs,
//! not why.
//!
//! A flexible term is a row of tent functions over a place on the road, a speed, a gap...; each adds a little acceleration. One simulation
//! gives its effect on the innovations, and a ridge regression on one part of the data gives the heights of the tents. The gain on the
//! other part is the evidence.

mod terms;

use crate::diagnose::likelihood::fit::Predictor;
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::observer::{KalmanGain, design};
use crate::diagnose::likelihood::robust::{Mask, block_length, rho};
use crate::diagnose::outcome::LeftOver;
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::fitted_model::{Context, FittedModel};
use crate::statistics::upper_median;
use crate::wgsl::extension_named;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::atomic::Ordering;
use terms::{Term, terms};

/// Structure that a model leaves.
#[derive(Debug, Clone, Default)]
pub struct Leftovers {
    /// Terms and bursts that pass the test.
    pub list: Vec<LeftOver>,
}

impl Leftovers {
    /// The flexible term with most evidence.
    #[must_use]
    pub fn strongest(&self) -> Option<&LeftOver> {
        let terms = self.list.iter().filter(|left| left.kind != BURSTS);
        terms.max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    }

    /// True if there are instants that no model follows.
    #[must_use]
    pub fn bursts(&self) -> bool {
        self.list.iter().any(|left| left.kind == BURSTS)
    }
}

const BURSTS: &str = "bursts";
/// Acceleration of a tent when its effect is measured \[m/s²\].
const TRIAL: f64 = 0.02;
/// Finite-difference step in the base's coordinates.
const STEP: f64 = 1e-4;
/// Prior standard deviation of the base's corrections in coordinates, and of tents \[m/s²\]; the better of the two values for tents counts.
const PRIOR_BASE: f64 = 0.1;
const PRIOR_TENTS: [f64; 2] = [0.3, 0.05];

/// Tests what a model leaves.
///
/// # Errors
/// As [`Predictor::residuals`].
pub fn leftovers(
    setting: &Context<'_>,
    candidate: &FittedModel,
    need: f64,
    inflation: f64,
) -> Result<Leftovers, DiagnoseError> {
    let mut left = Leftovers::default();
    let runs = candidate.model.innovations(&candidate.fit.point.values.clone(), &candidate.fit.point.noise)?;
    if runs.iter().any(|run| run.failed.is_some()) {
        return Ok(left);
    }
    let designs: Vec<KalmanGain> =
        candidate.model.drives().into_iter().map(|(_, dt)| design(&candidate.fit.point.noise, dt)).collect();
    let residuals: Vec<Vec<[f64; 2]>> = runs.iter().map(|run| run.residual.clone()).collect();
    let z: Vec<Vec<[f64; 2]>> =
        residuals.iter().zip(&designs).map(|(r, d)| r.iter().map(|r| d.white(*r)).collect()).collect();
    left.list.extend(bursts(setting, &z, inflation));
    let base = base_columns(setting, candidate, &residuals, &designs)?;
    let states: Vec<[f64; 5]> = runs.iter().enumerate().flat_map(|(k, run)| states(setting, k, run)).collect();
    for term in terms(setting, &states) {
        let Some(columns) = term_columns(setting, candidate, &term, &residuals, &designs)? else { continue };
        let parts = if term.kind == "road" && z.len() > 1 { by_drive(setting) } else { setting.folds.clone() };
        let dt: Vec<f64> = candidate.model.drives().into_iter().map(|(_, dt)| dt).collect();
        let Some(found) = regress(&z, &base, &columns, &parts, &setting.whole, &dt) else { continue };
        let passes =
            found.gain > need && found.parts.iter().all(|part| *part > 0.0) && found.trimmed > POLICY.trimmed * need;
        if passes {
            let place = format!("{}, most at {}", term.over, (term.place)(&term.tents[found.highest]));
            left.list.push(LeftOver { kind: term.kind.to_owned(), place, size: found.height, evidence: found.gain });
        }
    }
    Ok(left)
}

/// Spacing, speed, speed difference, model acceleration and position of every sample that counts.
fn states(setting: &Context<'_>, drive: usize, run: &crate::evaluator::Innovations) -> Vec<[f64; 5]> {
    let data = &setting.question.train[drive].trajectory;
    let counts = (0..run.state.len()).filter(|&t| setting.whole[drive][t]);
    counts
        .map(|t| {
            let [s, v, _] = run.state[t];
            [s, v, data.v_l[t] - v, run.acceleration[t], data.x_l[t] - data.len_l - s]
        })
        .collect()
}

type Columns = Vec<Vec<Vec<[f64; 2]>>>;

/// Effect of the base's and the causes' parameters on the innovations, per drive.
fn base_columns(
    setting: &Context<'_>,
    candidate: &FittedModel,
    residuals: &[Vec<[f64; 2]>],
    designs: &[KalmanGain],
) -> Result<Columns, DiagnoseError> {
    let axes = candidate.model.axes.clone();
    let values = &candidate.fit.point.values;
    let (mut moved, mut steps) = (Vec::new(), Vec::new());
    for (k, axis) in axes.iter().enumerate().filter(|(_, axis)| !axis.is_fixed()) {
        let u = axis.coordinate(values[k]);
        let size = STEP.max(axis.step);
        let step = if u + size > 1.0 { -size } else { size };
        let mut other = values.clone();
        other[k] = axis.value(u + step);
        moved.push(other);
        steps.push(step);
    }
    columns(setting, &candidate.model, &moved, &steps, residuals, designs)
}

fn term_columns(
    setting: &Context<'_>,
    candidate: &FittedModel,
    term: &Term,
    residuals: &[Vec<[f64; 2]>],
    designs: &[KalmanGain],
) -> Result<Option<Columns>, DiagnoseError> {
    let Some(probe) = extension_named(term.extension) else { return Ok(None) };
    let Ok(variant) = candidate.variant.with(probe) else { return Ok(None) };
    let model = setting.model(variant, &candidate.model.events)?;
    let positions = model.positions(probe);
    let values = model.adopt(&candidate.model, &candidate.fit.point.values);
    let tent = |tent: &Vec<f64>| {
        let mut moved = values.clone();
        moved[positions[0]] = TRIAL;
        positions[1..].iter().zip(tent).for_each(|(k, value)| moved[*k] = *value);
        moved
    };
    let moved: Vec<Vec<f64>> = term.tents.iter().map(tent).collect();
    let steps = vec![TRIAL; moved.len()];
    columns(setting, &model, &moved, &steps, residuals, designs).map(Some)
}

fn columns(
    setting: &Context<'_>,
    model: &Model,
    moved: &[Vec<f64>],
    steps: &[f64],
    residuals: &[Vec<[f64; 2]>],
    designs: &[KalmanGain],
) -> Result<Columns, DiagnoseError> {
    let before = model.simulations();
    let mut all = Vec::new();
    for (drive, (base, designed)) in residuals.iter().zip(designs).enumerate() {
        let mut found = Vec::with_capacity(moved.len());
        for (batch, steps) in moved.chunks(64).zip(steps.chunks(64)) {
            let runs = model.runs(drive, batch, &vec![*designed; batch.len()])?;
            found.par_extend(runs.into_par_iter().zip(steps).map(|(run, step)| {
                let Some(run) = run else { return vec![[0.0; 2]; base.len()] };
                let change =
                    |(a, b): (&[f64; 2], &[f64; 2])| designed.white([(a[0] - b[0]) / step, (a[1] - b[1]) / step]);
                run.iter().zip(base).map(change).collect()
            }));
        }
        all.push(found);
    }
    setting.simulations.fetch_add(model.simulations() - before, Ordering::Relaxed);
    Ok(all)
}

/// Splits the drives into two halves.
fn by_drive(setting: &Context<'_>) -> [Vec<Mask>; 2] {
    [0, 1].map(|part| {
        let keep = |(k, mask): (usize, &Mask)| if k % 2 == part { mask.clone() } else { vec![false; mask.len()] };
        setting.whole.iter().enumerate().map(keep).collect()
    })
}

struct Found {
    gain: f64,
    parts: [f64; 2],
    trimmed: f64,
    highest: usize,
    height: f64,
}

/// Products of all columns and of the innovations with them, over the samples of a part.
fn products(z: &[Vec<[f64; 2]>], base: &Columns, tents: &Columns, masks: &[Mask]) -> (DMatrix<f64>, DVector<f64>) {
    let width = base[0].len() + tents[0].len();
    let whole: Vec<f64> = (0..z.len())
        .into_par_iter()
        .flat_map(|drive| (0..z[drive].len()).into_par_iter().step_by(2000).map(move |from| (drive, from)))
        .map(|(drive, from)| {
            let mut sums = vec![0.0; (width + 1) * (width + 1)];
            let mut line = vec![0.0; width + 1];
            for t in (from..(from + 2000).min(z[drive].len())).filter(|t| masks[drive][*t]) {
                for signal in 0..2 {
                    let columns = base[drive].iter().chain(&tents[drive]);
                    line.iter_mut().zip(columns).for_each(|(x, column)| *x = column[t][signal]);
                    line[width] = z[drive][t][signal];
                    for (j, &x) in line.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                        let row = &mut sums[j * (width + 1)..j * (width + 1) + j + 1];
                        row.iter_mut().zip(&line).for_each(|(sum, y)| *sum += x * y);
                    }
                }
            }
            sums
        })
        .collect::<Vec<_>>()
        .into_iter()
        .reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect())
        .unwrap_or_else(|| vec![0.0; (width + 1) * (width + 1)]);
    let at = |j: usize, k: usize| whole[j.max(k) * (width + 1) + j.min(k)];
    (DMatrix::from_fn(width, width, at), DVector::from_fn(width, |j, _| at(width, j)))
}

/// Ridge regression on each part, scored on the other one.
fn regress(
    z: &[Vec<[f64; 2]>],
    base: &Columns,
    tents: &Columns,
    parts: &[Vec<Mask>; 2],
    whole: &[Mask],
    dt: &[f64],
) -> Option<Found> {
    let (count, width) = (base[0].len(), base[0].len() + tents[0].len());
    let counted = z.iter().zip(whole).flat_map(|(z, mask)| z.iter().zip(mask).filter(|(_, counts)| **counts));
    let (sum, n) = counted.fold((0.0, 0.0), |(sum, n), (z, _)| (sum + z[0] * z[0] + z[1] * z[1], n + 2.0));
    let variance: f64 = sum / n;
    let products: Vec<_> = parts.iter().map(|masks| products(z, base, tents, masks)).collect();
    let solve = |part: usize, upto: usize, sd: f64| -> Option<DVector<f64>> {
        let (matrix, right) = &products[part];
        let ridge = |j: usize| variance / (if j < count { PRIOR_BASE } else { sd }).powi(2);
        let matrix = DMatrix::from_fn(upto, upto, |a, b| matrix[(a, b)] + if a == b { ridge(a) } else { 0.0 });
        let solved = matrix.cholesky()?.solve(&right.rows(0, upto).into_owned());
        Some(-solved)
    };
    let score = |part: usize, weights: &DVector<f64>| blocks(z, base, tents, weights, &parts[part], variance, dt);
    let mut best: Option<Found> = None;
    for sd in PRIOR_TENTS {
        let (mut sums, mut all, mut heights) = ([0.0; 2], Vec::new(), Vec::new());
        for (judged, sum) in sums.iter_mut().enumerate() {
            let fitted = 1 - judged;
            let with = score(judged, &solve(fitted, width, sd)?);
            let without = score(judged, &solve(fitted, count, sd)?);
            let plain = score(judged, &DVector::zeros(0));
            let total = |blocks: &[f64]| blocks.iter().sum::<f64>();
            // A bad fit of the base must not favour every term.
            let other = if total(&without) > total(&plain) { without } else { plain };
            let gains: Vec<f64> = with.iter().zip(&other).map(|(a, b)| a - b).collect();
            *sum = total(&gains);
            all.extend(gains);
            heights.push(solve(fitted, width, sd)?);
        }
        all.sort_by(|a, b| b.total_cmp(a));
        let gain = sums[0] + sums[1];
        if best.as_ref().is_none_or(|best| gain > best.gain) {
            let height = |j: usize| 0.5 * (heights[0][count + j] + heights[1][count + j]);
            let weight = |j: usize| {
                let seen = products[0].0[(count + j, count + j)] + products[1].0[(count + j, count + j)];
                height(j).abs() * seen.sqrt()
            };
            let highest = (0..width - count).max_by(|&a, &b| weight(a).total_cmp(&weight(b)))?;
            let trimmed = all.iter().skip(2).sum();
            best = Some(Found { gain, parts: sums, trimmed, highest, height: height(highest) });
        }
    }
    best
}

/// Robust log-likelihood per block of 30 s after a correction.
fn blocks(
    z: &[Vec<[f64; 2]>],
    base: &Columns,
    tents: &Columns,
    weights: &DVector<f64>,
    masks: &[Mask],
    variance: f64,
    dt: &[f64],
) -> Vec<f64> {
    let mut all = Vec::new();
    for (drive, z) in z.iter().enumerate() {
        let length = block_length(dt[drive]);
        let columns: Vec<&Vec<[f64; 2]>> = base[drive].iter().chain(&tents[drive]).take(weights.len()).collect();
        let mut sums = vec![0.0; z.len().div_ceil(length)];
        for (t, z) in z.iter().enumerate().filter(|(t, _)| masks[drive][*t]) {
            let mut z = *z;
            for (column, weight) in columns.iter().zip(weights.iter()) {
                z[0] += weight * column[t][0];
                z[1] += weight * column[t][1];
            }
            sums[t / length] -= rho((z[0] * z[0] + z[1] * z[1]) / variance);
        }
        all.extend(sums);
    }
    all
}

/// Instants with unusually large innovations.
fn bursts(setting: &Context<'_>, z: &[Vec<[f64; 2]>], inflation: f64) -> Option<LeftOver> {
    /// Median of chi-squared with two degrees of freedom.
    const MEDIAN: f64 = 1.386_294_361;
    let mut sizes: Vec<(usize, usize, f64)> = Vec::new();
    for (drive, z) in z.iter().enumerate() {
        let data = &setting.question.train[drive].trajectory;
        let counts = (0..z.len()).filter(|&t| setting.whole[drive][t] && data.v_f[t] > 1.0);
        sizes.extend(counts.map(|t| (drive, t, z[t][0] * z[t][0] + z[t][1] * z[t][1])));
    }
    let usual = upper_median(sizes.iter().map(|(.., size)| *size))? / MEDIAN;
    let large: Vec<&(usize, usize, f64)> = sizes.iter().filter(|(.., size)| size / usual > POLICY.burst).collect();
    let block = |(drive, t, _): &&(usize, usize, f64)| {
        (*drive, (*t as f64 * setting.question.train[*drive].dt() / POLICY.block) as usize)
    };
    let blocks: std::collections::BTreeSet<(usize, usize)> = large.iter().map(block).collect();
    if (large.len() as f64) < POLICY.bursts * inflation || (blocks.len() as f64) < POLICY.burst_blocks {
        return None;
    }
    let (drive, t, _) = large.iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
    let drive = &setting.question.train[*drive];
    let place = format!("single instants, the largest at {:.1} s of {}", drive.trajectory.t[*t], drive.label());
    let size = large.len() as f64;
    Some(LeftOver { kind: BURSTS.to_owned(), place, size, evidence: size / inflation })
}
