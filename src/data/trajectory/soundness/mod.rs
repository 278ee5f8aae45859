//! Checks the soundness of the data, for every command.
//!
//! The gap and the two speeds of a link are redundant: d(gap)/dt = v_l - v_f. The checks detect, measure and name contradictions before a
//! model is fitted, and correct them only on request. They refuse nothing; reading and preparation refuse unusable data.

mod clocks;
mod correct;
mod finding;
mod held;
mod jumps;
mod level;
mod limits;
mod link;
mod noise;
mod offset;
mod spectrum;
mod time;
mod units;

pub use correct::correct;
pub use finding::{Finding, FindingKind, Remedy, Who};
pub use limits::{LIMITS, Limits};
pub use link::Link;
pub(super) use link::gap_column;

pub use crate::fourier;
use crate::trajectory::{Platoon, Recording};
use std::ops::Range;

/// Soundness of the data of one follower.
#[derive(Debug, Clone, PartialEq)]
pub struct Soundness {
    /// The faults, in the order of the checks and not by severity.
    pub findings: Vec<Finding>,
    /// Faults that these data cannot reveal, one sentence each.
    pub unseen: Vec<String>,
    /// Root mean square of gap rate minus speed difference over one second \[m/s\].
    pub rate_rms_mps: Option<f64>,
}

/// Why the data of a follower cannot be checked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: follower {follower} has no gap, or no car ahead; `leadlag inspect` lists what the file has")]
pub struct NoLink {
    path: String,
    follower: usize,
}

/// Checks the link of a follower (1 = right behind the platoon leader) in the recording's platoon number `platoon`. Fails for an unknown link.
pub fn check(recording: &Recording, platoon: usize, follower: usize) -> Result<Soundness, NoLink> {
    let none = || NoLink { path: recording.source.path.clone(), follower };
    let platoon = recording.platoons.get(platoon).ok_or_else(none)?;
    let link = Link::of(recording, platoon, follower, [None; 2]).ok_or_else(none)?;
    Ok(check_platoon(platoon, &link))
}

/// Checks a link, and the times of its platoon.
pub fn check_platoon(platoon: &Platoon, link: &Link) -> Soundness {
    // With another unit of time, no other comparison is possible.
    let mut soundness = match time::of_unit(link) {
        Some(finding) => Soundness { findings: vec![finding], unseen: Vec::new(), rate_rms_mps: None },
        None => check_link(link),
    };
    soundness.findings.splice(0..0, time::of_clock(&platoon.t));
    for finding in &mut soundness.findings {
        let row = finding.when.first().map(|[from, _]| platoon.t.partition_point(|&t| t < from - 0.5 * link.dt));
        finding.line = row.and_then(|row| platoon.lines.get(row)).copied();
    }
    soundness
}

pub fn check_link(measured: &Link) -> Soundness {
    let mut link = measured.clone();
    let mut findings = Vec::new();
    let mut broken: Vec<Range<usize>> = Vec::new();
    let (mut blurred, mut slow) = (false, measured.dt * LIMITS.slow_rate >= 1.0);
    for (k, signal) in measured.signals().into_iter().enumerate() {
        let values = &mut *[&mut link.v_l, &mut link.v_f, &mut link.gap][k];
        let resampled = noise::resampled(&signal, measured);
        let mut dropouts = held::dropouts(&signal, measured, resampled.as_ref().map_or(1.0, |r| r.factor));
        let spikes = jumps::spikes(&signal, measured);
        // A short run of one wrong value is a spike.
        dropouts.leave_out(&spikes);
        broken.extend(dropouts.ranges.iter().chain(&spikes).cloned());
        findings.extend(held::finding(&signal, measured, &dropouts));
        findings.extend(jumps::spiky(&signal, measured, &spikes));
        findings.extend(noise::quantised(&signal));
        if let Some(found) = resampled {
            if found.held {
                // Held values are late by half of their duration, which is not another fault.
                values.clone_from(&noise::joined(signal.values, found.factor));
            }
            blurred = true;
            slow |= found.finding.matters;
            findings.push(found.finding);
        } else if let Some(smoothed) = noise::smoothed(&signal, measured) {
            blurred = true;
            findings.push(smoothed);
        }
        // Unmeasured samples and spikes contain no information about the other signals.
        for range in dropouts.ranges.iter().chain(&spikes) {
            values[range.clone()].fill(f64::NAN);
        }
    }
    findings.splice(0..0, units::too_fast(&link));
    // A held signal has no noise between its own samples.
    findings.extend(noise::drowned(&link));
    let mut unseen = Vec::new();
    let mut usable = level::Usable::new(&link, &broken, &[]);
    // A wrong unit explains any other contradiction.
    if let Some(factor) = units::factor(&link) {
        findings.push(factor);
    } else {
        let jumps = jumps::find(&link, &broken);
        findings.extend(jumps::finding(&link, &jumps));
        usable = level::Usable::new(&link, &broken, &jumps);
        let whole = 0..link.len();
        let measured = level::rate_rms(&link, std::slice::from_ref(&whole)).filter(|rms| *rms > LIMITS.contradiction);
        let mut left = measured.map(|rms| (rms, LIMITS.contradiction));
        match clocks::Redundancy::estimate(&link, &usable, slow) {
            Some(redundancy) => {
                findings.extend(redundancy.findings(&link, blurred));
                // After correction of scales and clocks; without other evidence, that is enough.
                let rms = redundancy.residual_rate_rms(&link, &usable);
                let rms = level::rate_rms(&link, &usable.stretches).map_or(rms, |measured| measured.min(rms));
                left = left.or((rms > LIMITS.unrelated).then_some((rms, LIMITS.unrelated)));
            }
            None => {
                unseen.push(
                    "speed scales and clock offsets: there is no stretch of driving long enough to compare gap and speeds"
                        .to_owned(),
                );
            }
        }
        findings.extend(left.map(|(rms, limit)| jumps::drifting(&link, rms, limit)));
    }
    match offset::gap_offset(&link) {
        offset::Seen::Finding(finding) => findings.push(*finding),
        offset::Seen::Sound => {}
        offset::Seen::No(why) => unseen.push(why.to_owned()),
    }
    Soundness { findings, unseen, rate_rms_mps: level::rate_rms(&link, &usable.stretches) }
}

#[cfg(test)]
mod tests;
