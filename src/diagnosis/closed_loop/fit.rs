//! The least logarithmic loss, from many starts at once.
//!
//! Its derivative is that of a sum of squares in which every bin weighs as its present error says, so that steps of Gauss and Newton with
//! fresh weights lead there (iteratively reweighted least squares), damped by Levenberg and Marquardt.

use super::loss::{Bin, errors, of_run};
use super::{ClosedLoop, Horizon, SIGNALS};
use crate::diagnose::DiagnoseError;
use crate::diagnose::likelihood::model::FreeRun;
use crate::diagnose::likelihood::space::Axis;
use nalgebra::{DMatrix, DVector};

/// Parameters with their loss.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Of the model, in its order.
    pub values: Vec<f64>,
    /// Mean logarithmic loss on the drives it was fitted to, and what failures cost.
    pub loss: f64,
}

/// How long to search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Turns of all starts.
    pub rough: usize,
    /// Starts of each group that go on.
    pub keep: usize,
    /// Turns of these at most.
    pub fine: usize,
}

/// A gain of less than this in the mean logarithm of squared errors is none: a thousandth of a per cent.
const TOLERANCE: f64 = 2e-5;
/// Turns without a gain after which a start stands.
const IDLE: usize = 2;
/// Damping at the begin, the factors of it that are tried in a turn, and where a start is stuck.
const DAMPING: f64 = 1e-2;
/// See [`DAMPING`].
const FACTORS: [f64; 4] = [0.03, 1.0, 10.0, 300.0];
/// See [`DAMPING`].
const STUCK: f64 = 1e6;
/// Longest step in a coordinate.
const LONGEST: f64 = 0.3;
/// Least curvature of a coordinate, so that what does nothing stays where it is.
const FLAT: f64 = 1e-7;
/// A slope that is none: one of two neighbours has failed and goes on elsewhere.
const STEEP: f64 = 1e4;
/// Step of a difference, as a share of an axis; limits that bind now and then need one that is not lost between two samples.
const STEP: f64 = 1e-4;

struct Start<'a> {
    x: Vec<f64>,
    axes: &'a [Axis],
    counts: &'a [bool],
    group: usize,
    loss: f64,
    damping: f64,
    idle: usize,
}

impl Start<'_> {
    fn values(&self, x: &[f64]) -> Vec<f64> {
        self.axes.iter().zip(x).map(|(axis, u)| axis.value(*u)).collect()
    }

    fn moves(&self) -> bool {
        self.idle < IDLE && self.damping < STUCK && self.loss.is_finite()
    }
}

/// Fits from some starts, each on the drives of its group (`groups` says of every group which drives count, `starts` of every start its
/// group and parameters). Returns the best of each group.
///
/// # Errors
/// As [`ClosedLoop::losses`].
pub fn fit(
    model: &ClosedLoop,
    axes: &[Axis],
    horizon: Horizon,
    groups: &[Vec<bool>],
    starts: &[(usize, Vec<f64>)],
    plan: Plan,
) -> Result<Vec<Option<Point>>, DiagnoseError> {
    let start = |(group, values): &(usize, Vec<f64>)| Start {
        x: axes.iter().zip(values).map(|(axis, value)| axis.coordinate(*value)).collect(),
        axes,
        counts: &groups[*group],
        group: *group,
        loss: f64::INFINITY,
        damping: DAMPING,
        idle: 0,
    };
    let mut starts: Vec<Start> = starts.iter().map(start).collect();
    let first: Vec<(usize, Vec<f64>)> = starts.iter().enumerate().map(|(k, start)| (k, start.x.clone())).collect();
    let losses = losses(model, horizon, &starts, &first)?;
    starts.iter_mut().zip(losses).for_each(|(start, loss)| start.loss = loss);
    for turn in 0..plan.rough + plan.fine {
        if turn == plan.rough {
            starts = kept(starts, plan.keep);
        }
        if !advance(model, horizon, &mut starts)? {
            break;
        }
    }
    let best = |group: usize| {
        let mine = starts.iter().filter(|start| start.group == group && start.loss.is_finite());
        let best = mine.min_by(|a, b| a.loss.total_cmp(&b.loss))?;
        Some(Point { values: best.values(&best.x), loss: best.loss })
    };
    Ok((0..groups.len()).map(best).collect())
}

/// The best starts of each group.
fn kept(mut starts: Vec<Start<'_>>, keep: usize) -> Vec<Start<'_>> {
    starts.sort_by(|a, b| (a.group, a.loss).partial_cmp(&(b.group, b.loss)).expect("losses are numbers or infinite"));
    let (mut group, mut rank) = (usize::MAX, 0);
    starts.retain(|start| {
        rank = if start.group == group { rank + 1 } else { 0 };
        group = start.group;
        rank < keep
    });
    starts
}

/// Losses at coordinates, each with the start that it belongs to.
fn losses(
    model: &ClosedLoop,
    horizon: Horizon,
    starts: &[Start<'_>],
    at: &[(usize, Vec<f64>)],
) -> Result<Vec<f64>, DiagnoseError> {
    let candidates: Vec<Vec<f64>> = at.iter().map(|(k, x)| starts[*k].values(x)).collect();
    let counts = |i: usize, drive: usize| starts[at[i].0].counts[drive];
    Ok(model.losses(&candidates, horizon, &counts)?.iter().map(|losses| losses.cost()).collect())
}

/// One turn of all starts that still move; false if none does.
fn advance(model: &ClosedLoop, horizon: Horizon, starts: &mut [Start<'_>]) -> Result<bool, DiagnoseError> {
    let moving: Vec<usize> = (0..starts.len()).filter(|&k| starts[k].moves()).collect();
    if moving.is_empty() {
        return Ok(false);
    }
    let normal = normal_equations(model, horizon, starts, &moving)?;
    let mut trials = Vec::new();
    for (&k, normal) in moving.iter().zip(&normal) {
        trials.extend(FACTORS.map(|factor| (k, normal.step(&starts[k], starts[k].damping * factor))));
    }
    let losses = losses(model, horizon, starts, &trials)?;
    for (i, &k) in moving.iter().enumerate() {
        let mine = i * FACTORS.len()..(i + 1) * FACTORS.len();
        let best = mine.min_by(|&a, &b| losses[a].total_cmp(&losses[b])).expect("there are factors");
        let start = &mut starts[k];
        let gain = start.loss - losses[best];
        if gain > 0.0 {
            start.damping = (start.damping * FACTORS[best % FACTORS.len()]).max(1e-7);
            start.x.clone_from(&trials[best].1);
            start.loss = losses[best];
        } else {
            start.damping *= 1000.0;
        }
        start.idle = if gain > TOLERANCE { 0 } else { start.idle + 1 };
    }
    Ok(true)
}

/// Gradient and curvature of the mean logarithmic loss in the coordinates of a start.
struct Normal {
    gradient: DVector<f64>,
    curvature: DMatrix<f64>,
}

impl Normal {
    /// A damped step, kept within 0 and 1: what would leave them stays there, and the others step again without it.
    fn step(&self, start: &Start<'_>, damping: f64) -> Vec<f64> {
        let x = &start.x;
        let outward = |j: usize| (x[j] <= 0.0 && self.gradient[j] > 0.0) || (x[j] >= 1.0 && self.gradient[j] < 0.0);
        let mut free: Vec<usize> = (0..x.len()).filter(|&j| !start.axes[j].is_fixed() && !outward(j)).collect();
        let mut next = x.clone();
        while !free.is_empty() {
            let matrix = DMatrix::from_fn(free.len(), free.len(), |a, b| {
                let own = if a == b { damping * self.curvature[(free[a], free[a])] + FLAT } else { 0.0 };
                self.curvature[(free[a], free[b])] + own
            });
            let right = DVector::from_fn(free.len(), |a, _| -self.gradient[free[a]]);
            let Some(step) = matrix.cholesky().map(|c| c.solve(&right)) else { return x.clone() };
            let ratio = step.iter().map(|d| d.abs() / LONGEST).fold(1.0, f64::max);
            next.clone_from(x);
            let wanted = |a: usize| x[free[a]] + step[a] / ratio;
            let inside: Vec<usize> = (0..free.len()).filter(|&a| (0.0..=1.0).contains(&wanted(a))).collect();
            for a in 0..free.len() {
                next[free[a]] = wanted(a).clamp(0.0, 1.0);
            }
            // Whoever is at its bound already and wants out holds the others up no longer.
            let leave = |a: &usize| !inside.contains(a) && (x[free[*a]] <= 0.0 || x[free[*a]] >= 1.0);
            let stuck: Vec<usize> = (0..free.len()).filter(leave).map(|a| free[a]).collect();
            if stuck.is_empty() {
                break;
            }
            free.retain(|j| !stuck.contains(j));
        }
        next
    }
}

fn normal_equations(
    model: &ClosedLoop,
    horizon: Horizon,
    starts: &[Start<'_>],
    moving: &[usize],
) -> Result<Vec<Normal>, DiagnoseError> {
    let (mut candidates, mut of) = (Vec::new(), Vec::new());
    // Where each start begins, and which coordinates move by how much.
    let mut moves: Vec<(usize, Vec<(usize, f64)>)> = Vec::new();
    for &k in moving {
        let start = &starts[k];
        let first = candidates.len();
        candidates.push(start.values(&start.x));
        let mut moved = Vec::new();
        for (j, axis) in start.axes.iter().enumerate().filter(|(_, axis)| !axis.is_fixed()) {
            let size = STEP.max(axis.step);
            let step = if start.x[j] + size > 1.0 { -size } else { size };
            let mut x = start.x.clone();
            x[j] += step;
            candidates.push(start.values(&x));
            moved.push((j, step));
        }
        of.resize(candidates.len(), k);
        moves.push((first, moved));
    }
    let counts = |i: usize, drive: usize| starts[of[i]].counts[drive];
    let runs = model.on_drives(&candidates, horizon, &counts, &|_, run| run)?;
    let m = starts[moving[0]].axes.len();
    let mut bins = vec![0.0; moving.len()];
    let zero = || Normal { gradient: DVector::zeros(m), curvature: DMatrix::zeros(m, m) };
    let mut all: Vec<Normal> = moving.iter().map(|_| zero()).collect();
    for (drive, mine, runs) in &runs {
        let layout = &model.layouts(horizon)[*drive];
        let run_of = |i: usize| mine.binary_search(&i).ok().map(|place| &runs[place]);
        for ((normal, bins), (first, moved)) in all.iter_mut().zip(&mut bins).zip(&moves) {
            let Some(base) = run_of(*first) else { continue };
            let moved: Vec<(usize, f64, &FreeRun)> = (moved.iter().enumerate())
                .filter_map(|(n, (j, step))| Some((*j, *step, run_of(first + 1 + n)?)))
                .collect();
            let loss = of_run(base, layout, &model.measured[*drive]);
            add(normal, base, &moved, layout, &loss.bins);
            *bins += loss.bins.len() as f64;
        }
    }
    for (normal, bins) in all.iter_mut().zip(bins) {
        normal.gradient /= bins.max(1.0);
        normal.curvature /= bins.max(1.0);
    }
    Ok(all)
}

/// Adds what a drive says: per bin and signal the mean of products, times the weight of the bin.
fn add(normal: &mut Normal, base: &FreeRun, moved: &[(usize, f64, &FreeRun)], layout: &super::Layout, bins: &[Bin]) {
    let mut sizes = vec![0.0_f64; bins.len()];
    layout.bins.iter().flatten().for_each(|k| sizes[*k as usize] += 1.0);
    let mut slopes = vec![[0.0; SIGNALS]; moved.len()];
    for (t, k) in layout.bins.iter().enumerate() {
        let Some(k) = k else { continue };
        let weights = bins[*k as usize].weights().map(|w| w / sizes[*k as usize]);
        let here = errors(base, layout, t);
        if !here[0].is_finite() {
            continue;
        }
        for (slope, (_, step, run)) in slopes.iter_mut().zip(moved) {
            let there = errors(run, layout, t);
            // Where a run fails, or one beside it, there is no slope.
            *slope = std::array::from_fn(|k| (there[k] - here[k]) / step)
                .map(|x: f64| if x.abs() < STEEP { x } else { 0.0 });
        }
        for (a, (j, ..)) in moved.iter().enumerate() {
            let weighted: [f64; SIGNALS] = std::array::from_fn(|k| weights[k] * slopes[a][k]);
            normal.gradient[*j] += (0..SIGNALS).map(|k| weighted[k] * here[k]).sum::<f64>();
            for (b, (i, ..)) in moved.iter().enumerate().take(a + 1) {
                let product: f64 = (0..SIGNALS).map(|k| weighted[k] * slopes[b][k]).sum();
                normal.curvature[(*j, *i)] += product;
                if i != j {
                    normal.curvature[(*i, *j)] += product;
                }
            }
        }
    }
}
