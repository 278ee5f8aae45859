//! Contradictions of gap and speeds that no constant explains: jumps, and a drift of what is left.

use super::finding::{Finding, FindingKind, Who, interval};
use super::link::Link;
use crate::diagnose::policy::POLICY;
use crate::statistics::robust_scale;
use std::ops::Range;

/// Time within which a jump may happen \[s\].
const WITHIN_S: f64 = 1.0;
/// Jumps that get a line of their own.
pub(super) const LISTED: usize = 10;

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

/// Gap change minus integrated speed difference from one sample to the next \[m\]; NaN where something is missing.
pub(super) fn innovations(link: &Link, broken: &[Range<usize>]) -> Vec<f64> {
    let dv = |i: usize| link.v_l[i] - link.v_f[i];
    let mut d: Vec<f64> =
        (1..link.len()).map(|i| link.gap[i] - link.gap[i - 1] - (dv(i) + dv(i - 1)) / 2.0 * link.dt).collect();
    for range in broken {
        let end = (range.end + 1).min(link.len());
        d[range.start.saturating_sub(1)..end.saturating_sub(1)].fill(f64::NAN);
    }
    d
}

/// Jumps outside of the broken ranges.
pub(super) fn find(link: &Link, broken: &[Range<usize>]) -> Vec<Jump> {
    let mut d = innovations(link, broken);
    let usual = robust_scale(d.iter().copied()).unwrap_or(f64::NAN);
    let mut jumps: Vec<Jump> = Vec::new();
    let together = link.samples(WITHIN_S);
    for (i, d) in d.iter_mut().enumerate() {
        if d.abs() > POLICY.jump.max(POLICY.unusual * usual) {
            match jumps.last_mut() {
                // Jumps close together are one event: a spike, or a target that is lost and found.
                Some(last) if i - last.range.end < together => {
                    last.size += *d;
                    last.range.end = i + 1;
                    last.peak = if d.abs() > last.peak.abs() { *d } else { last.peak };
                }
                _ => jumps.push(Jump { range: i..i + 1, size: *d, peak: *d, error: usual }),
            }
            *d = 0.0;
        }
    }
    let width = link.samples(WITHIN_S).min(d.len().max(1));
    let sums: Vec<f64> = d.windows(width).map(|w| w.iter().sum()).collect();
    let usual = robust_scale(sums.iter().copied()).unwrap_or(f64::NAN);
    let limit = POLICY.slow_jump.max(POLICY.unusual * usual);
    let mut i = 0;
    while i < sums.len() {
        // NaN where something is missing is no jump.
        if sums[i].abs() <= limit || sums[i].is_nan() {
            i += 1;
            continue;
        }
        // The window in which most of it lies.
        let best = (i..(i + width).min(sums.len()))
            .filter(|&k| sums[k].is_finite())
            .max_by(|&a, &b| sums[a].abs().total_cmp(&sums[b].abs()))
            .unwrap_or(i);
        jumps.push(Jump { range: best..best + width, size: sums[best], peak: sums[best], error: usual });
        i = best + width;
    }
    jumps.sort_by(|a, b| b.peak.abs().total_cmp(&a.peak.abs()));
    jumps
}

impl Jump {
    pub fn finding(&self, link: &Link) -> Finding {
        let (from, to) = (link.time(self.range.start), link.time(self.range.end));
        // What returns within the event is as large as its largest step.
        let value = if self.size.abs() < 0.5 * self.peak.abs() { self.peak } else { self.size };
        let what = match (value == self.peak && self.range.len() > 1, value > 0.0) {
            (true, _) => "by up to".to_owned(),
            (_, up) => format!("{} by", if up { "up" } else { "down" }),
        };
        Finding {
            kind: FindingKind::Inconsistent,
            car: Who::Follower,
            signal: "gap",
            value,
            unit: "m",
            interval: interval(value, self.error),
            when: vec![[from, to]],
            sentence: format!(
                "the gap jumps {what} {:.2} m at {to:.1} s, which the two speeds do not show: another target?",
                value.abs()
            ),
        }
    }
}

/// What is left after scales and clocks were allowed for is too large for signals of the same two cars.
pub(super) fn drifting(link: &Link, rms_mps: f64) -> Option<Finding> {
    (rms_mps > POLICY.unrelated).then(|| Finding {
        kind: FindingKind::Inconsistent,
        car: Who::Either,
        signal: "gap",
        value: rms_mps,
        unit: "m/s",
        interval: None,
        when: vec![[link.time(0), link.time(link.len().saturating_sub(1))]],
        sentence: format!(
            "gap and speeds contradict each other: the rate of the gap is off by {rms_mps:.1} m/s (rms over a second) \
             whatever scale and clock are assumed; one of the three signals is broken"
        ),
    })
}
