//! One link of two cars: does the measured gap agree with the two speeds?

use super::Axis;
use crate::statistics::rms;
use crate::trajectory::agreement::{gap_column, rate_rms};
use crate::trajectory::prepare::slope;
use crate::trajectory::soundness::{Finding, Link, check_platoon};
use crate::trajectory::steps::longest_step;
use crate::trajectory::{Car, Platoon, Recording, factor};
use serde::Serialize;
use std::ops::Range;

/// Longest time offset that is tried between gap and speeds \[samples\].
const SHIFT_MAX: usize = 20;
/// An offset is accepted only if it removes this share of the disagreement.
const SHIFT_GAIN: f64 = 0.1;

/// One link, named after the follower's car number.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, reason = "names of fields carry meaning and unit")]
pub struct LinkInspection {
    pub follower_car: usize,
    /// Column of the gap in the file.
    pub signal: String,
    /// Central difference of the gap over time, minus the speed difference.
    pub gap_rate_rms_mps: Option<f64>,
    /// Delay of the speeds against the gap at the best agreement.
    pub speeds_late_s: f64,
    /// Their disagreement there.
    pub gap_rate_rms_aligned_mps: Option<f64>,
    /// Measured gap minus first gap plus integrated speed difference, over the longest complete stretch.
    pub drift_rms_m: Option<f64>,
    pub drift_m_per_km: Option<f64>,
    pub longest_complete_s: f64,
    /// Ratio of the change of the gap to that by the speeds, if it is certain and not about 1.
    pub gap_factor: Option<f64>,
    /// Faults of the signals.
    pub findings: Vec<Finding>,
}

pub(super) fn inspect(
    lead: &Car,
    ego: &Car,
    axis: &Axis,
    platoon: &Platoon,
    recording: &Recording,
) -> Option<LinkInspection> {
    let gap = ego.gap.as_ref()?;
    let dv: Vec<f64> = lead.v.iter().zip(&ego.v).map(|(v_l, v_f)| v_l - v_f).collect();
    let longest = longest_step(axis.t);
    let disagreement = |shift| rate_rms(axis.t, gap, &dv, shift, longest);
    let aligned = disagreement(0);
    let limit = SHIFT_MAX.min(gap.len() / 4) as isize;
    let best =
        (-limit..=limit).filter_map(|shift| Some((shift, disagreement(shift)?))).min_by(|a, b| a.1.total_cmp(&b.1));
    let best = match (aligned, best) {
        (Some(now), Some((_, best))) if best >= now * (1.0 - SHIFT_GAIN) => (0, Some(now)),
        (_, Some((shift, best))) => (shift, Some(best)),
        _ => (0, aligned),
    };
    let complete = longest_complete(axis, |i| gap[i].is_finite() && dv[i].is_finite());
    let drift = drift(axis.t, gap, &dv, &ego.v, complete.clone());
    let found = Link::of(recording, platoon, lead.number, [None; 2]);
    Some(LinkInspection {
        follower_car: ego.number,
        signal: gap_column(ego.number, recording.layout),
        gap_rate_rms_mps: aligned,
        speeds_late_s: best.0 as f64 * axis.step,
        gap_rate_rms_aligned_mps: best.1,
        drift_rms_m: drift.map(|drift| drift.0),
        drift_m_per_km: drift.map(|drift| drift.1),
        gap_factor: factor::of_gap([(axis.t, dv.as_slice(), gap.as_slice())]),
        findings: found.map_or_else(Vec::new, |link| check_platoon(platoon, &link).findings),
        longest_complete_s: complete.len().saturating_sub(1) as f64 * axis.step,
    })
}

/// Longest run of samples, without missing rows, in which `complete` holds.
fn longest_complete(axis: &Axis, complete: impl Fn(usize) -> bool) -> Range<usize> {
    let mut longest = 0..0;
    for stretch in &axis.stretches {
        let mut start = stretch.start;
        for i in stretch.clone() {
            if !complete(i) {
                start = i + 1;
            } else if i + 1 - start > longest.len() {
                longest = start..i + 1;
            }
        }
    }
    longest
}

/// Residual of the gap against the integrated speeds: rms \[m\] and slope over the follower's path \[m/km\]. A single sample, or none,
/// does not determine it.
fn drift(t: &[f64], gap: &[f64], dv: &[f64], v_f: &[f64], range: Range<usize>) -> Option<(f64, f64)> {
    if range.len() < 2 {
        return None;
    }
    let (mut s, mut x) = (gap[range.start], 0.0);
    let (mut residuals, mut path) = (vec![0.0], vec![0.0]);
    for i in range.skip(1) {
        let dt = t[i] - t[i - 1];
        s += (dv[i - 1] + dv[i]) / 2.0 * dt;
        x += (v_f[i - 1] + v_f[i]) / 2.0 * dt;
        residuals.push(gap[i] - s);
        path.push(x);
    }
    Some((rms(residuals.iter().copied())?, slope(&path, &residuals) * 1000.0))
}

#[cfg(test)]
mod tests {
    use super::drift;

    #[test]
    fn nothing_drifts_within_less_than_two_samples() {
        let (t, gap, v) = ([0.0, 1.0, 2.0, 3.0], [10.0, 11.0, 12.0, 13.0], [5.0; 4]);
        let of = |range| drift(&t, &gap, &[0.0; 4], &v, range);
        assert_eq!([of(0..0), of(4..4), of(2..3)], [None; 3]);
        // The gap grows by 1 m in 5 m of distance although the speeds are the same.
        let (rms, slope) = of(1..3).expect("two samples");
        assert!((rms - 0.5f64.sqrt()).abs() < 1e-12 && (slope - 200.0).abs() < 1e-9, "{rms} {slope}");
    }
}
