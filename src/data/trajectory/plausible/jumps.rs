//! A gap that jumps: another car is ahead from there on, or the sensor lost it.

use super::Signals;
use crate::statistics::robust_scale;

/// A gap that changes by so much more than the speeds say from one sample to the next has jumped \[m\] ...
const JUMP_M: f64 = 2.0;
/// ... or within a second \[m\]; both also in robust standard deviations of what it usually does.
const SLOW_JUMP_M: f64 = 3.0;
const UNUSUAL: f64 = 12.0;
/// Time within which a jump may happen, and what is closer together is one event \[s\].
const WITHIN_S: f64 = 1.0;
/// Across longer stretches without a value nothing is compared \[s\].
const UNSEEN_S: f64 = 2.0;
/// Jumps that are named.
const NAMED: usize = 3;

/// A jump: last time before it, first time after it, its size \[m\], and the largest change in it.
struct Jump {
    before: f64,
    after: f64,
    size: f64,
    peak: f64,
    /// Gap before and after it \[m\].
    gap: [f64; 2],
}

pub(super) fn said(signals: &Signals) -> Option<String> {
    let jumps = find(signals);
    let first = jumps.first()?;
    let [from, to] = longest_without(signals, &jumps);
    let mut text = format!("{}: jumps ", signals.called);
    for (i, jump) in jumps.iter().take(NAMED).enumerate() {
        let returns = jump.size.abs() < 0.5 * jump.peak.abs();
        let how = match (returns, jump.size > 0.0) {
            (true, _) => format!("by up to {:.1} m", jump.peak.abs()),
            (_, up) => format!("{} by {:.1} m", if up { "up" } else { "down" }, jump.size.abs()),
        };
        let [before, after] = jump.gap;
        text += &format!("{}{how} ({before:.1} to {after:.1} m) at {:.1} s", if i > 0 { ", " } else { "" }, jump.after);
    }
    if jumps.len() > NAMED {
        text += &format!(", and {} more times", jumps.len() - NAMED);
    }
    let (begin, end) = (signals.t[0], signals.t[signals.t.len() - 1]);
    let mut flags = String::new();
    if from > begin {
        flags += &format!(" --from {}", short(from));
    }
    if to < end {
        flags += &format!(" --to {}", short(to));
    }
    let what = if first.size < 0.0 { "a car that cut in" } else { "another car ahead" };
    Some(format!(
        "{text}, which the two speeds do not show: {what}?{} is the longest stretch without",
        if flags.is_empty() { " The whole".to_owned() } else { flags }
    ))
}

/// Without rounding dust.
fn short(t: f64) -> f64 {
    (t * 1e3).round() / 1e3
}

/// The jumps in the order of time.
fn find(signals: &Signals) -> Vec<Jump> {
    let told = signals.told();
    let t = signals.t;
    let seen: Vec<usize> = (0..t.len()).filter(|&i| signals.gap[i].is_finite() && told[i].is_finite()).collect();
    let left = |i: usize| signals.gap[i] - told[i];
    let steps: Vec<f64> = seen
        .windows(2)
        .map(|pair| if t[pair[1]] - t[pair[0]] > UNSEEN_S { 0.0 } else { left(pair[1]) - left(pair[0]) })
        .collect();
    let limit = JUMP_M.max(UNUSUAL * robust_scale(steps.iter().copied()).unwrap_or(0.0));
    // (first sample, last sample) of each event, by place in `seen`.
    let mut events: Vec<[usize; 2]> = Vec::new();
    let mut quick = vec![false; steps.len()];
    for (i, _) in steps.iter().enumerate().filter(|(_, step)| step.abs() > limit) {
        quick[i] = true;
        join(&mut events, [i, i + 1], |a, b| t[seen[b]] - t[seen[a]] < WITHIN_S);
    }
    let slow: Vec<f64> = steps.iter().zip(&quick).map(|(step, quick)| if *quick { 0.0 } else { *step }).collect();
    events.extend(slow_events(&slow, &seen, t));
    events.sort_unstable();
    // What overlaps is one event.
    events.dedup_by(|next, last| {
        let is_one = next[0] < last[1];
        last[1] = if is_one { last[1].max(next[1]) } else { last[1] };
        is_one
    });
    let jump = |[from, to]: [usize; 2]| {
        let [a, b] = [seen[from], seen[to]];
        let peak =
            steps[from..to].iter().copied().fold(0.0, |m: f64, step| if step.abs() > m.abs() { step } else { m });
        let size = left(b) - left(a);
        let peak = if to - from > 1 && size.abs() > peak.abs() { size } else { peak };
        Jump { before: t[a], after: t[b], size, peak, gap: [signals.gap[a], signals.gap[b]] }
    };
    events.into_iter().map(jump).collect()
}

/// Events that take up to a second.
fn slow_events(steps: &[f64], seen: &[usize], t: &[f64]) -> Vec<[usize; 2]> {
    let mut sums: Vec<f64> = Vec::with_capacity(steps.len());
    let mut ends: Vec<usize> = Vec::with_capacity(steps.len());
    let (mut end, mut sum) = (0, 0.0);
    for start in 0..steps.len() {
        while end < steps.len() && t[seen[end + 1]] - t[seen[start]] <= WITHIN_S + 1e-6 {
            sum += steps[end];
            end += 1;
        }
        if end <= start {
            (end, sum) = (start, 0.0);
        }
        sums.push(sum);
        ends.push(end);
        if end > start {
            sum -= steps[start];
        }
    }
    let limit = SLOW_JUMP_M.max(UNUSUAL * robust_scale(sums.iter().copied()).unwrap_or(0.0));
    let mut events: Vec<[usize; 2]> = Vec::new();
    let mut start = 0;
    while start < sums.len() {
        if sums[start].abs() <= limit {
            start += 1;
            continue;
        }
        // The window in which most of it lies.
        let best = (start..=ends[start].min(sums.len() - 1))
            .max_by(|&a, &b| sums[a].abs().total_cmp(&sums[b].abs()))
            .unwrap_or(start);
        events.push([best, ends[best]]);
        start = ends[best].max(start + 1);
    }
    events
}

/// Adds an event, to the last one if they are close.
fn join(events: &mut Vec<[usize; 2]>, event: [usize; 2], close: impl Fn(usize, usize) -> bool) {
    match events.last_mut() {
        Some(last) if close(last[1], event[0]) => last[1] = event[1],
        _ => events.push(event),
    }
}

/// First and last time of the longest stretch in which the gap does not jump.
fn longest_without(signals: &Signals, jumps: &[Jump]) -> [f64; 2] {
    let mut from = signals.t[0];
    let mut stretches = Vec::with_capacity(jumps.len() + 1);
    for jump in jumps {
        stretches.push([from, jump.before]);
        from = jump.after;
    }
    stretches.push([from, signals.t[signals.t.len() - 1]]);
    // The first of equally long ones.
    let longer = |a: [f64; 2], b: [f64; 2]| if b[1] - b[0] > a[1] - a[0] + 1e-6 { b } else { a };
    stretches.into_iter().reduce(longer).expect("there is at least one")
}
