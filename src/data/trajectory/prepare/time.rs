//! The time axis: its step, missing rows, and resampling.

use super::Context;
use super::samples::{GRID_TOLERANCE_S, Samples};
use crate::statistics::upper_median;
use crate::trajectory::{Note, PrepareError};
use std::ops::Range;

/// A longer time step means a wrong unit \[s\].
pub(in crate::trajectory) const STEP_MAX_S: f64 = 5.0;
/// Longest step of a simulation \[s\]: with a longer one a model has other parameters than the driver. Of drives recorded at 1 Hz, four in
/// five had intervals without the truth. Between such samples the model uses its own steps, unless another step is requested ...
const COARSE_STEP_S: f64 = 0.5;
/// ... of at most this length \[s\].
const SUBSTEP_S: f64 = 0.1;
/// More samples than this are refused: 139 hours at 10 Hz.
const SAMPLES_MAX: usize = 5_000_000;

/// Stretches of data on a uniform time step, none of which has a gap longer than allowed between its rows.
pub(super) struct Blocks {
    /// Nominal step \[s\].
    pub dt: f64,
    pub blocks: Vec<Samples>,
}

impl Blocks {
    /// Begins another block at a time \[s\].
    pub fn split(&mut self, t_s: f64) {
        let part = |block: Samples| {
            let at = block.t.partition_point(|&t| t < t_s - GRID_TOLERANCE_S);
            if at == 0 || at == block.t.len() {
                return vec![block];
            }
            vec![block.slice(0..at), block.slice(at..block.t.len())]
        };
        self.blocks = std::mem::take(&mut self.blocks).into_iter().flat_map(part).collect();
    }
}

/// Puts the samples on a uniform time step; missing rows become missing values, and resampling happens only on request.
pub(super) fn uniform(samples: Samples, context: &Context, notes: &mut Vec<Note>) -> Result<Blocks, PrepareError> {
    let max_gap_s = context.preparation.max_gap_s;
    let Some(step) = median_step(&samples.t) else {
        return Ok(Blocks { dt: 1.0, blocks: vec![samples] });
    };
    let ranges = stretches(&samples.t, max_gap_s.max(1.5 * step));
    let dt = nominal_step(&samples.t, &ranges, step);
    let path = context.path();
    if dt > STEP_MAX_S {
        let limit = STEP_MAX_S;
        return Err(PrepareError::StepTooLong { path, step: dt, limit });
    }
    let steps = (dt / SUBSTEP_S).ceil();
    let wanted = context.preparation.resample.or_else(|| (dt > COARSE_STEP_S).then_some(dt / steps));
    let target = wanted.unwrap_or(dt);
    let count: f64 =
        ranges.iter().map(|range| (samples.t[range.end - 1] - samples.t[range.start]) / target + 1.0).sum();
    if count.is_nan() || count > SAMPLES_MAX as f64 {
        return Err(PrepareError::TooManySamples { path, step: target, samples: count, limit: SAMPLES_MAX });
    }
    let mut blocks = Vec::with_capacity(ranges.len());
    for range in ranges.clone() {
        blocks.push(match wanted {
            Some(step) => resample(&samples, range, step, max_gap_s.max(1.5 * dt)),
            None => on_grid(&samples, range, dt, context)?,
        });
    }
    if let Some(to_s) = wanted {
        // Interpolated and counted like every other gap.
        let gaps = ranges.iter().flat_map(|range| samples.t[range.clone()].windows(2)).map(|pair| pair[1] - pair[0]);
        let long: Vec<f64> = gaps.filter(|gap| *gap > 1.5 * step).collect();
        if !long.is_empty() {
            let rows = long.iter().map(|gap| (gap / step).round() as usize - 1).sum();
            notes.push(Note::RowsFilled { rows, longest_s: long.iter().copied().fold(0.0, f64::max) });
        }
        notes.push(Note::Resampled {
            from_s: step,
            to_s,
            rows: samples.t.len(),
            samples: blocks.iter().map(|block| block.t.len()).sum(),
        });
    }
    Ok(Blocks { dt: target, blocks })
}

/// Median difference of successive times \[s\].
pub(in crate::trajectory) fn median_step(t: &[f64]) -> Option<f64> {
    let steps = t.windows(2).map(|pair| pair[1] - pair[0]);
    upper_median(steps).filter(|&step| step > 0.0 && step.is_finite())
}

/// Ranges of rows between which time jumps by more than `max_gap_s`.
pub(in crate::trajectory) fn stretches(t: &[f64], max_gap_s: f64) -> Vec<Range<usize>> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for i in 1..=t.len() {
        if i == t.len() || t[i] - t[i - 1] > max_gap_s + GRID_TOLERANCE_S {
            ranges.push(start..i);
            start = i;
        }
    }
    ranges
}

/// The step that the longest stretch keeps \[s\]: a decimal of up to 6 places where one fits all its rows.
pub(in crate::trajectory) fn nominal_step(t: &[f64], ranges: &[Range<usize>], step: f64) -> f64 {
    let Some(longest) = ranges.iter().max_by_key(|range| range.len()) else {
        return step;
    };
    let t = &t[longest.clone()];
    let steps: f64 = t.windows(2).map(|pair| ((pair[1] - pair[0]) / step).round()).sum();
    let span = t[t.len() - 1] - t[0];
    if steps < 1.0 || !steps.is_finite() {
        return step;
    }
    let mean = span / steps;
    let decimal = (mean * 1e6).round() / 1e6;
    if decimal > 0.0 && (decimal * steps - span).abs() <= GRID_TOLERANCE_S { decimal } else { mean }
}

/// Rows on the grid `t[0] + k dt`; rows that are missing in between are inserted with missing values.
fn on_grid(samples: &Samples, range: Range<usize>, dt: f64, context: &Context) -> Result<Samples, PrepareError> {
    let t_0 = samples.t[range.start];
    let mut places = Vec::with_capacity(range.len());
    for i in range.clone() {
        let t = samples.t[i];
        let place = ((t - t_0) / dt).round();
        let next = places.last().map_or(0.0, |&last: &usize| last as f64 + 1.0);
        if place < next || (t - (t_0 + place * dt)).abs() > GRID_TOLERANCE_S * 1.001 {
            return Err(PrepareError::Irregular {
                path: context.path(),
                line: samples.lines[i].unwrap_or_default(),
                column: context.recording.layout.time_column(),
                expected: six_decimals(t_0 + next * dt),
                step: six_decimals(dt),
                found: t,
            });
        }
        // `uniform` has checked that the number of samples is small.
        places.push(place as usize);
    }
    let count = places.last().map_or(0, |last| last + 1);
    let mut grid = Samples {
        t: (0..count).map(|k| t_0 + k as f64 * dt).collect(),
        lines: vec![None; count],
        channels: Vec::new(),
    };
    for (i, &place) in range.clone().zip(&places) {
        grid.t[place] = samples.t[i];
        grid.lines[place] = samples.lines[i];
    }
    for (signal, values) in &samples.channels {
        let mut on_grid = vec![f64::NAN; count];
        for (i, &place) in range.clone().zip(&places) {
            on_grid[place] = values[i];
        }
        grid.channels.push((*signal, on_grid));
    }
    Ok(grid)
}

/// Linear interpolation of each signal between its own values, where these are at most `max_gap_s` apart.
fn resample(samples: &Samples, range: Range<usize>, dt: f64, max_gap_s: f64) -> Samples {
    let t = &samples.t[range.clone()];
    let span = t[t.len() - 1] - t[0];
    let count = ((span + GRID_TOLERANCE_S) / dt).floor() as usize + 1;
    let grid: Vec<f64> = (0..count).map(|k| t[0] + k as f64 * dt).collect();
    let on_grid = |y: &[f64]| -> Vec<f64> {
        let own: Vec<usize> = (0..y.len()).filter(|&i| y[i].is_finite()).collect();
        let mut next = 0;
        let value = |t_k: f64| {
            // The first own value that is not before the grid point, and the one before it.
            while next < own.len() && t[own[next]] < t_k - 1e-9 * dt {
                next += 1;
            }
            let (b, a) = (own.get(next).copied(), next.checked_sub(1).map(|a| own[a]));
            match (a, b) {
                (_, Some(b)) if t[b] - t_k <= 1e-9 * dt => y[b],
                (Some(a), Some(b)) if t[b] - t[a] <= max_gap_s + GRID_TOLERANCE_S => {
                    y[a] + (y[b] - y[a]) * (t_k - t[a]) / (t[b] - t[a])
                }
                // The last grid point may lie behind the last row by rounding.
                (Some(a), None) if t_k - t[a] <= GRID_TOLERANCE_S => y[a],
                _ => f64::NAN,
            }
        };
        grid.iter().copied().map(value).collect()
    };
    let row = |t_k: &f64| t.partition_point(|t| *t <= t_k + 1e-9 * dt).saturating_sub(1);
    Samples {
        channels: samples.channels.iter().map(|(signal, y)| (*signal, on_grid(&y[range.clone()]))).collect(),
        lines: grid.iter().map(|t_k| samples.lines[range.start + row(t_k)]).collect(),
        t: grid,
    }
}

/// For messages: without the rounding errors of sums.
fn six_decimals(t: f64) -> f64 {
    (t * 1e6).round() / 1e6
}
