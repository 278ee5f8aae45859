//! Drop-outs: values that are missing, held while the car moves on, or filled in by a straight line.

use super::finding::{Finding, FindingKind, Remedy};
use super::limits::LIMITS;
use super::link::{Link, Signal};
use super::noise::{self, quantum};
use crate::statistics::robust_scale;
use crate::text::option::CORRECT;
use crate::text::shown::counted;
use crate::trajectory::steps::runs;
use std::ops::Range;

/// Shortest run that counts \[samples\].
const SHORTEST: usize = 4;
/// Equal neighbours more often than this come from a coarse sensor.
const COARSE: f64 = 0.005;

/// Samples of a signal that were not measured.
pub(super) struct Dropouts {
    /// All of them.
    pub ranges: Vec<Range<usize>>,
    /// Samples with a value, without these.
    held: Vec<Range<usize>>,
}

impl Dropouts {
    /// Omits samples that other findings cover.
    pub fn leave_out(&mut self, reported: &[Range<usize>]) {
        let apart = |range: &Range<usize>| reported.iter().all(|t| range.start > t.end || t.start > range.end);
        self.ranges.retain(apart);
        self.held.retain(apart);
    }
}

/// Samples that were not measured. `factor` is the usual number of samples for which a value is held.
pub(super) fn dropouts(signal: &Signal, link: &Link, factor: f64) -> Dropouts {
    let y = signal.values;
    let q = quantum(y);
    let first = y.iter().position(|v| v.is_finite()).unwrap_or(y.len());
    let last = y.iter().rposition(|v| v.is_finite()).map_or(0, |i| i + 1);
    let missing: Vec<Range<usize>> = runs(first..last.max(first), |i| y[i].is_nan()).collect();
    let mut found: Vec<Range<usize>> = Vec::new();
    let steps: Vec<f64> = y.windows(2).map(|w| w[1] - w[0]).collect();
    let bends: Vec<f64> = y.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).collect();
    let bend = robust_scale(bends.iter().copied()).unwrap_or(f64::NAN);
    // Chance of two equal neighbours, and of three on a line: with noise of this size and values rounded to q, or as often as
    // single repeats occur, which a coarse sensor makes and a drop-out does not.
    let sigma = (bend / 6f64.sqrt()).max(1e-12);
    let single =
        runs(0..steps.len(), |i| steps[i] == 0.0).filter(|run| run.len() == 1 && !both_stand(link, run)).count();
    let repeat = (q / (2.0 * std::f64::consts::PI.sqrt() * sigma)).max(3.0 * single as f64 / y.len() as f64).min(1.0);
    // Second differences of neighbours share samples, so they are small together: twice the chance of one.
    let line = (10.0 * q / (bend.max(1e-12) * std::f64::consts::TAU.sqrt())).min(1.0);
    let longest = |chance: f64| {
        let by_chance = (LIMITS.held_chance / y.len() as f64).ln() / chance.max(1e-9).ln();
        let held = (1.5 * factor).ceil() as usize;
        (by_chance.ceil() as usize).saturating_add(1).max(SHORTEST).max(held + usize::from(factor > 1.0) * SHORTEST)
    };
    // A held value: steps of zero.
    for run in runs(0..steps.len(), |i| steps[i] == 0.0).filter(|run| !both_stand(link, run)) {
        let at_zero = y[run.start].abs() < super::link::DRIVING;
        let fallen = steepest(&steps, &run) > impossible(signal, link);
        let kept = if repeat < COARSE {
            run.len() + 1 >= longest(repeat) && (!at_zero || fallen)
        } else {
            // With a coarse sensor, only the step at the end or a necessary change of the gap shows it.
            let long = run.len() as f64 * link.dt >= LIMITS.held && run.len() as f64 > 1.5 * factor;
            let jumps = || steepest(&steps, &run) > LIMITS.held_step.max(20.0 * sigma).max(2.5 * q);
            let moves = || signal.name == "gap" && change_within(link, &run) > LIMITS.held_change.max(3.0 * q);
            long && (jumps() || moves())
        };
        if kept {
            // The first of equal values was measured, unless no car can reach it: a drop to zero, or the value of a radar without a
            // target.
            let comes = run.start.checked_sub(1).is_none_or(|i| steps[i].abs() <= impossible(signal, link));
            let measured = usize::from(!at_zero && comes);
            found.push(run.start + measured..run.end + 1);
        }
    }
    // A straight line: second differences of zero between steps that are not. A signal without noise has straight parts. The second
    // differences of a smooth motion are similar, and small together: only those of a sensor's noise alternate.
    if line < 0.3 && factor <= 1.0 && noise::noisy(signal, link) && alternate(&bends) {
        let tolerance = 2.5 * q;
        for run in runs(0..bends.len(), |i| bends[i].abs() <= tolerance && steps[i] != 0.0) {
            if run.len() >= longest(line) && !both_stand(link, &run) {
                found.push(run.start + 1..run.end + 1);
            }
        }
    }
    let held = merge(found);
    Dropouts { ranges: merge(missing.into_iter().chain(held.iter().cloned()).collect()), held }
}

/// True if neighbouring second differences tend to have opposite signs: those of white noise have a correlation of -2/3.
fn alternate(bends: &[f64]) -> bool {
    let product: f64 = bends.windows(2).map(|w| w[0] * w[1]).filter(|p| p.is_finite()).sum();
    product < 0.0
}

/// Change of the gap within a run of steps by the speeds \[m\].
fn change_within(link: &Link, run: &Range<usize>) -> f64 {
    let (mut sum, mut low, mut high) = (0.0, 0.0_f64, 0.0_f64);
    for i in run.clone() {
        let step = link.change_by_speeds(i, i + 1);
        sum += if step.is_finite() { step } else { 0.0 };
        (low, high) = (low.min(sum), high.max(sum));
    }
    high - low
}

/// At rest nothing moves, so nothing is held.
fn both_stand(link: &Link, run: &Range<usize>) -> bool {
    let slow = |v: &[f64]| v[run.clone()].iter().filter(|v| **v < super::link::DRIVING).count() * 2 > run.len();
    slow(&link.v_l) && slow(&link.v_f)
}

/// The larger one of the steps into and out of a run of equal values.
fn steepest(steps: &[f64], run: &Range<usize>) -> f64 {
    let step = |i: Option<usize>| i.and_then(|i| steps.get(i)).map_or(0.0, |step| step.abs());
    step(run.start.checked_sub(1)).max(step(Some(run.end)))
}

/// A step between two samples that no car can make: 12 m/s² in a speed, 1 m in a gap.
fn impossible(signal: &Signal, link: &Link) -> f64 {
    if signal.name == "gap" { 1.0 } else { 12.0 * link.dt }
}

/// Joins ranges that touch or overlap.
pub(super) fn merge(mut ranges: Vec<Range<usize>>) -> Vec<Range<usize>> {
    ranges.sort_by_key(|range| range.start);
    let mut merged: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match merged.last_mut() {
            Some(last) if range.start <= last.end + 1 => last.end = last.end.max(range.end),
            _ => merged.push(range),
        }
    }
    merged
}

/// One finding for all drop-outs of a signal.
pub(super) fn finding(signal: &Signal, link: &Link, found: &Dropouts) -> Option<Finding> {
    let seconds = |ranges: &[Range<usize>]| ranges.iter().map(Range::len).sum::<usize>() as f64 * link.dt;
    // Preparation reports missing values; a filled-in value that looks measured is worse.
    let matters = seconds(&found.held) >= LIMITS.held_matters * link.len() as f64 * link.dt;
    let shown = if matters { &found.held } else { &found.ranges };
    let longest = shown.iter().max_by_key(|range| range.len())?;
    let at = signal.values[longest.start];
    let stays = longest.clone().all(|i| signal.values[i] == at);
    let at =
        if stays { format!(", at {at} {} to the last digit while the cars move", signal.unit) } else { String::new() };
    Some(Finding {
        when: found.ranges.iter().map(|r| [link.time(r.start), link.time(r.end - 1)]).collect(),
        matters,
        remedies: vec![Remedy::of(CORRECT)],
        sentence: format!(
            "{}: {:.1} s in {} were not measured but are missing, held or filled in; the longest is {:.1} s from {:.1} s on{at}",
            signal.title,
            seconds(&found.ranges),
            counted(found.ranges.len(), "piece"),
            longest.len() as f64 * link.dt,
            link.time(longest.start)
        ),
        ..Finding::new(FindingKind::Dropout, signal.who, signal.name, seconds(&found.ranges), "s")
    })
}
