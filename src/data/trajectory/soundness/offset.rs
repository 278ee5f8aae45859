//! A constant error of the gap: only positions of both cars can reveal it.

use super::finding::{Finding, FindingKind, Remedy, Who, Z_95, interval};
use super::limits::LIMITS;
use super::link::Link;
use crate::statistics::upper_median;
use crate::text::option::CORRECT;

/// Blocks for the standard error \[s\].
const BLOCK_S: f64 = 30.0;

/// Estimate of the offset of the gap.
pub(super) enum Seen {
    Finding(Box<Finding>),
    Sound,
    /// Why the data cannot reveal it.
    No(&'static str),
}

pub(super) fn gap_offset(link: &Link) -> Seen {
    let (Some(x_l), Some(x_f)) = (&link.x_l, &link.x_f) else {
        return Seen::No("a constant error of the gap (needs positions of both cars)");
    };
    let Some(len_l) = link.len_l else {
        return Seen::No("a constant error of the gap (needs the length of the car ahead)");
    };
    let off = |i: usize| link.gap[i] - (x_l[i] - x_f[i] - len_l);
    let starts = (0..link.len()).step_by(link.samples(BLOCK_S));
    let medians: Vec<f64> = starts
        .filter_map(|start| {
            let block = start..(start + link.samples(BLOCK_S)).min(link.len());
            upper_median(block.map(off).filter(|d| d.is_finite()))
        })
        .collect();
    let n = medians.len() as f64;
    if n < 3.0 {
        return Seen::No("a constant error of the gap (needs more positions)");
    }
    let mean = medians.iter().sum::<f64>() / n;
    let error = (medians.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
    if mean.abs() <= LIMITS.least_offset.max(LIMITS.significant * error) {
        return Seen::Sound;
    }
    Seen::Finding(Box::new(Finding {
        interval: interval(mean, error),
        matters: mean.abs() > LIMITS.offset_matters,
        remedies: vec![Remedy::of(CORRECT)],
        sentence: format!(
            "the gap is {mean:+.2} ± {:.2} m off the distance of the two positions less the length of the car ahead",
            Z_95 * error
        ),
        ..Finding::new(FindingKind::GapOffset, Who::Follower, "gap", mean, "m")
    }))
}
