//! Missing values: short gaps are interpolated, long ones split the data.

use super::Context;
use super::samples::GRID_TOLERANCE_S;
use super::samples::{Samples, Signal};
use super::time::Blocks;
use crate::trajectory::error::problem::{DAYS_STEP_S, HOURS_STEP_S};
use crate::trajectory::steps::runs;
use crate::trajectory::{Note, PrepareError};
use std::ops::Range;

/// A stretch in which every required signal has a value at every sample.
pub(super) struct Segment {
    pub samples: Samples,
    pub notes: Vec<Note>,
}

/// Fills gaps up to `max_gap_s` and cuts at the longer ones; stretches shorter than `least_s` are dropped.
pub(super) fn split(
    blocks: Blocks,
    max_gap_s: f64,
    least_s: f64,
    context: &Context,
    notes: &mut Vec<Note>,
) -> Result<Vec<Segment>, PrepareError> {
    let dt = blocks.dt;
    let mut segments = Vec::new();
    let mut longest: f64 = 0.0;
    let ends = blocks
        .blocks
        .first()
        .and_then(|block| block.t.first())
        .zip(blocks.blocks.last().and_then(|block| block.t.last()));
    let whole = ends.map_or(0.0, |(first, last)| last - first);
    for measured in blocks.blocks {
        let mut filled = measured.clone();
        for (_, values) in &mut filled.channels {
            fill(values, dt, max_gap_s);
        }
        let required = filled.channels.iter().filter(|(s, _)| s.is_required());
        let required: Vec<&[f64]> = required.map(|(_, v)| v.as_slice()).collect();
        let complete = |i: usize| required.iter().all(|values| values[i].is_finite());
        for range in runs(0..filled.t.len(), complete) {
            let span = (range.len() - 1) as f64 * dt;
            longest = longest.max(span);
            let mut samples = filled.slice(range.clone());
            if span < least_s - GRID_TOLERANCE_S {
                notes.push(Note::Dropped { from_s: samples.t[0], to_s: samples.t[range.len() - 1], needed_s: least_s });
                continue;
            }
            let before = measured.slice(range);
            let mut notes = Vec::new();
            leave_out(&mut samples, &mut notes);
            count(&before, &samples, dt, &mut notes);
            segments.push(Segment { samples, notes });
        }
    }
    if segments.is_empty() {
        let (path, follower, needed) = (context.path(), context.follower, least_s);
        let rounded = |time: f64| (time * 1e6).round() / 1e6;
        // If the whole is too short, interpolation does not help.
        if whole < least_s - GRID_TOLERANCE_S {
            let is_cut = context.preparation.from.is_some() || context.preparation.to.is_some();
            let what = match is_cut {
                _ if dt < DAYS_STEP_S => {
                    "recording, whose times look like days (a column map with unit = \"day\" reads them),"
                }
                _ if dt < HOURS_STEP_S => {
                    "recording, whose times look like hours (a column map with unit = \"h\" reads them),"
                }
                true => "window",
                false => "recording",
            };
            return Err(PrepareError::Short { path, follower, what, needed, found: rounded(whole) });
        }
        return Err(PrepareError::TooShort { path, follower, needed, longest: rounded(longest) });
    }
    let count = segments.len();
    for (index, segment) in segments.iter_mut().enumerate().filter(|_| count > 1) {
        let t = &segment.samples.t;
        let note = Note::Split { segment: index + 1, segments: count, from_s: t[0], to_s: t[t.len() - 1] };
        segment.notes.insert(0, note);
    }
    Ok(segments)
}

/// Straight lines across gaps whose measured neighbours are at most `max_gap_s` apart.
fn fill(values: &mut [f64], dt: f64, max_gap_s: f64) {
    for gap in runs(0..values.len(), |i| values[i].is_nan()).collect::<Vec<_>>() {
        let steps = gap.len() as f64 + 1.0;
        let inside = gap.start > 0 && gap.end < values.len();
        if inside && steps * dt <= max_gap_s + GRID_TOLERANCE_S {
            let (before, after) = (values[gap.start - 1], values[gap.end]);
            for (k, value) in values[gap].iter_mut().enumerate() {
                *value = before + (after - before) * (k as f64 + 1.0) / steps;
            }
        }
    }
}

/// Removes optional signals that still have gaps; positions and grade are only sampled, not needed everywhere.
fn leave_out(samples: &mut Samples, notes: &mut Vec<Note>) {
    samples.channels.retain(|(signal, values)| {
        let missing = values.iter().filter(|value| value.is_nan()).count();
        let keep = missing == 0 || !matches!(signal, Signal::Lead2Speed | Signal::Lead2Spacing);
        if !keep {
            let signal = signal.into_str().to_owned();
            notes.push(Note::LeftOut { signal, missing });
        }
        keep
    });
}

/// Notes interpolated samples.
fn count(before: &Samples, after: &Samples, dt: f64, notes: &mut Vec<Note>) {
    let longest = |gaps: &[Range<usize>]| {
        let gap = gaps.iter().map(Range::len).max();
        gap.map_or(0.0, |gap| (gap as f64 + 1.0) * dt)
    };
    let no_row: Vec<Range<usize>> = runs(0..before.t.len(), |i| before.lines[i].is_none()).collect();
    if !no_row.is_empty() {
        notes.push(Note::RowsFilled { rows: no_row.iter().map(Range::len).sum(), longest_s: longest(&no_row) });
    }
    for (signal, now) in &after.channels {
        let Some(was) = before.channel(*signal) else {
            continue;
        };
        let filled = |i: usize| was[i].is_nan() && now[i].is_finite();
        let samples = (0..now.len()).filter(|&i| filled(i) && before.lines[i].is_some()).count();
        if samples > 0 {
            notes.push(Note::Filled {
                signal: signal.into_str().to_owned(),
                samples,
                longest_s: longest(&runs(0..now.len(), filled).collect::<Vec<_>>()),
            });
        }
    }
}
