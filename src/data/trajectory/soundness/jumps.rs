//! Contradictions of gap and speeds that no constant explains: jumps, single spikes, and a drift of the rest.

use super::finding::{Finding, FindingKind, Remedy, Who, interval};
use super::held::merge;
use super::limits::LIMITS;
use super::link::{Link, Signal, rates};
use crate::statistics::{robust_scale, upper_median};
use crate::text::option::{CORRECT, FROM, RECONCILE, TO};
use std::ops::Range;

/// Time within which a jump may happen; changes closer together are one event \[s\].
const WITHIN_S: f64 = 1.0;
/// Across longer stretches without a value there is no comparison \[s\].
const UNSEEN_S: f64 = 2.0;
/// A spike differs from the values up to this distance on either side \[s\]; a longer change is a jump.
const AROUND_S: f64 = 0.5;
/// Number of named jumps and spikes.
const NAMED: usize = 3;

/// A jump of the gap against the speeds.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Jump {
    /// Samples between which it happens.
    pub range: Range<usize>,
    /// Its size from before to after \[m\].
    pub size: f64,
    /// The largest step in it \[m\].
    pub peak: f64,
    /// Standard deviation of its size \[m\].
    pub error: f64,
}

impl Jump {
    /// A change that reverses within the event is as large as its largest step \[m\].
    fn value(&self) -> f64 {
        if self.returns() { self.peak } else { self.size }
    }

    fn returns(&self) -> bool {
        self.size.abs() < 0.5 * self.peak.abs()
    }

    fn matters(&self) -> bool {
        self.value().abs() > if self.range.len() == 1 { LIMITS.jump_matters } else { LIMITS.slow_jump_matters }
    }
}

/// Jumps outside of the broken ranges, in the order of time.
pub(super) fn find(link: &Link, broken: &[Range<usize>]) -> Vec<Jump> {
    let mut whole: Vec<bool> = (0..link.len()).map(|i| (link.gap[i] + link.v_l[i] + link.v_f[i]).is_finite()).collect();
    broken.iter().for_each(|range| whole[range.start..range.end.min(link.len())].fill(false));
    let seen: Vec<usize> = (0..link.len()).filter(|&i| whole[i]).collect();
    let unseen = link.samples(UNSEEN_S);
    let steps: Vec<f64> = seen
        .windows(2)
        .map(|pair| match pair[1] - pair[0] {
            apart if apart > unseen => 0.0,
            _ => link.step(pair[0], pair[1]),
        })
        .collect();
    let usual = robust_scale(steps.iter().copied()).unwrap_or(0.0);
    // (first sample, last sample) of each event, as indices of `seen`.
    let mut events: Vec<Range<usize>> = Vec::new();
    let mut slow = steps.clone();
    for (i, step) in steps.iter().enumerate() {
        let limit = if seen[i + 1] - seen[i] == 1 { LIMITS.jump } else { LIMITS.slow_jump };
        if step.abs() <= limit.max(LIMITS.unusual * usual) {
            continue;
        }
        slow[i] = 0.0;
        match events.last_mut() {
            // Jumps close together are one event: a target that is lost and found again.
            Some(last) if seen[i] - seen[last.end] < link.samples(WITHIN_S) => last.end = i + 1,
            _ => events.push(i..i + 1),
        }
    }
    events.extend(slow_events(&slow, &seen, link.samples(WITHIN_S)));
    events.sort_unstable_by_key(|event| (event.start, event.end));
    // Overlapping changes are one event.
    events.dedup_by(|next, last| {
        let is_one = next.start < last.end;
        last.end = if is_one { last.end.max(next.end) } else { last.end };
        is_one
    });
    let jump = |event: Range<usize>| {
        let larger = |m: f64, step: &f64| if step.abs() > m.abs() { *step } else { m };
        let (size, peak) = (steps[event.clone()].iter().sum::<f64>(), steps[event.clone()].iter().fold(0.0, larger));
        Jump { range: seen[event.start]..seen[event.end], size, peak: larger(peak, &size), error: usual }
    };
    events.into_iter().map(jump).collect()
}

/// Events that take up to `width` samples.
fn slow_events(steps: &[f64], seen: &[usize], width: usize) -> Vec<Range<usize>> {
    let (mut windows, mut end): (Vec<(Range<usize>, f64)>, usize) = (Vec::with_capacity(steps.len()), 0);
    for start in 0..steps.len() {
        end = end.max(start);
        while end < steps.len() && seen[end + 1] - seen[start] <= width {
            end += 1;
        }
        windows.push((start..end, steps[start..end].iter().sum()));
    }
    let usual = robust_scale(windows.iter().map(|window| window.1)).unwrap_or(0.0);
    let limit = LIMITS.slow_jump.max(LIMITS.unusual * usual);
    let (mut events, mut start) = (Vec::new(), 0);
    while start < windows.len() {
        let (window, sum) = &windows[start];
        if sum.abs() <= limit {
            start += 1;
            continue;
        }
        // The window with the largest part of it.
        let within = &windows[start..(window.end + 1).min(windows.len())];
        let (best, _) = within.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap_or(&windows[start]);
        events.push(best.clone());
        start = best.end.max(start + 1);
    }
    events
}

pub(super) fn finding(link: &Link, jumps: &[Jump]) -> Option<Finding> {
    let matters = jumps.iter().any(Jump::matters);
    // Beside large ones, small ones do not matter.
    let reported: Vec<&Jump> = jumps.iter().filter(|jump| !matters || jump.matters()).collect();
    let largest = reported.iter().copied().max_by(|a, b| a.value().abs().total_cmp(&b.value().abs()))?;
    let named: Vec<String> = reported.iter().take(NAMED).map(|jump| shown(link, jump)).collect();
    let more = match reported.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(", and {more} more times"),
    };
    let what = if reported[0].size < 0.0 { "a car that cut in" } else { "another car ahead" };
    Some(Finding {
        interval: interval(largest.value(), largest.error),
        when: reported.iter().map(|jump| [link.time(jump.range.start), link.time(jump.range.end)]).collect(),
        matters,
        remedies: longest_without(link, &reported),
        sentence: format!(
            "{}: jumps {}{more}, which the two speeds do not show: {what}?",
            link.called,
            named.join(", ")
        ),
        ..Finding::new(FindingKind::Inconsistent, Who::Follower, "gap", largest.value(), "m")
    })
}

fn shown(link: &Link, jump: &Jump) -> String {
    let (from, to, size) = (jump.range.start, jump.range.end, jump.value().abs());
    let how = match (jump.returns(), jump.size > 0.0) {
        (true, _) => "by up to",
        (_, true) => "up by",
        (_, false) => "down by",
    };
    format!("{how} {size:.1} m ({:.1} to {:.1} m) at {:.1} s", link.gap[from], link.gap[to], link.time(to))
}

/// The longest stretch in which the gap does not jump, as options; none if that is the whole drive.
fn longest_without(link: &Link, jumps: &[&Jump]) -> Vec<Remedy> {
    let last = link.len() - 1;
    let starts = std::iter::once(0).chain(jumps.iter().map(|jump| jump.range.end));
    let ends = jumps.iter().map(|jump| jump.range.start).chain([last]);
    // The first of equally long ones.
    let longer = |a: (usize, usize), b: (usize, usize)| if b.1 - b.0 > a.1 - a.0 { b } else { a };
    let (from, to) = starts.zip(ends).reduce(longer).unwrap_or((0, last));
    // Without rounding dust.
    let time = |option, sample| Remedy { option, value: Some(format!("{}", (link.time(sample) * 1e3).round() / 1e3)) };
    let from = (from > 0).then(|| time(FROM, from));
    from.into_iter().chain((to < last).then(|| time(TO, to))).collect()
}

/// Samples of a signal that are far from their neighbours and return at once: no car moves like that.
pub(super) fn spikes(signal: &Signal, link: &Link) -> Vec<Range<usize>> {
    let y = signal.values;
    let bends = y.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]);
    let usual = robust_scale(bends).unwrap_or(0.0) / 6f64.sqrt();
    let reach = link.samples(AROUND_S).max(2);
    // Within half of the reach, a car that brakes as hard as possible departs from the surrounding median by this.
    let half = 0.5 * reach as f64 * link.dt;
    let driven =
        if signal.name == "gap" { LIMITS.spike.max(0.5 * LIMITS.braking * half * half) } else { LIMITS.braking * half };
    let limit = driven.max(LIMITS.unusual * usual);
    let steep: Vec<usize> = (1..y.len()).filter(|&i| (y[i] - y[i - 1]).abs() > 0.5 * limit).collect();
    let off = |i: usize| {
        let near = i.saturating_sub(reach)..(i + reach + 1).min(y.len());
        let median = upper_median(y[near].iter().copied().filter(|y| y.is_finite()));
        median.is_some_and(|median| (y[i] - median).abs() > limit)
    };
    let mut found: Vec<Range<usize>> = Vec::new();
    for &step in &steep {
        let near = step.saturating_sub(reach).max(found.last().map_or(0, |last| last.end))..(step + reach).min(y.len());
        for i in near.filter(|&i| off(i)) {
            match found.last_mut() {
                Some(last) if last.end == i => last.end = i + 1,
                _ => found.push(i..i + 1),
            }
        }
    }
    // A change that does not reverse is a jump, at whose end the median is on either side.
    found.retain(|range| {
        let value = |i: Option<usize>| i.and_then(|i| y.get(i)).copied().unwrap_or(f64::NAN);
        let (before, after) = (value(range.start.checked_sub(1)), value(Some(range.end)));
        (before - after).abs() < 0.5 * (y[range.start] - before).abs()
    });
    // If every tenth value is off, none is an exception.
    if found.iter().map(Range::len).sum::<usize>() as f64 > LIMITS.spikes * y.len() as f64 {
        found.clear();
    }
    found
}

pub(super) fn spiky(signal: &Signal, link: &Link, spikes: &[Range<usize>]) -> Option<Finding> {
    let size = |range: &Range<usize>| signal.values[range.start] - signal.values[range.start - 1];
    let largest = spikes.iter().map(size).reduce(|a, b| if b.abs() > a.abs() { b } else { a })?;
    let samples: usize = spikes.iter().map(Range::len).sum();
    let times: Vec<String> = spikes.iter().take(NAMED).map(|r| format!("{:.1}", link.time(r.start))).collect();
    let more = if spikes.len() > NAMED { ", ..." } else { "" };
    let mut remedies = vec![Remedy::of(CORRECT)];
    if signal.name == "gap" {
        remedies.push(Remedy { option: RECONCILE, value: Some("speeds".to_owned()) });
    }
    Some(Finding {
        when: spikes.iter().map(|r| [link.time(r.start), link.time(r.end - 1)]).collect(),
        matters: true,
        remedies,
        sentence: format!(
            "{}: {samples} of {} samples are spikes, off by up to {:.1} {} and back at once, at {}{more} s: no car moves like that",
            signal.title,
            link.len(),
            largest.abs(),
            signal.unit,
            times.join(", ")
        ),
        ..Finding::new(FindingKind::Spike, signal.who, signal.name, largest, signal.unit)
    })
}

/// The remainder is too large for signals of the same two cars; over some seconds it exceeds `limit` \[m/s\].
pub(super) fn drifting(link: &Link, rms_mps: f64, limit: f64) -> Finding {
    let second = link.samples(1.0);
    let whole = 0..link.len();
    let over =
        rates(link, std::slice::from_ref(&whole)).filter(|(_, rate)| rate.abs() > limit).map(|(i, _)| i..i + second);
    Finding {
        when: merge(over.collect()).iter().map(|r| [link.time(r.start), link.time(r.end)]).collect(),
        matters: true,
        sentence: format!("{}: contradicts the speeds (rms {rms_mps:.1} m/s): broken?", link.called),
        ..Finding::new(FindingKind::Inconsistent, Who::Either, "gap", rms_mps, "m/s")
    }
}
