//! Is the data itself sound? The gap and the two speeds of a link are redundant: d(gap)/dt = v_l - v_f.
//!
//! What contradicts itself is found, sized and named before any model is blamed, and corrected only on request.

mod clocks;
mod correct;
mod finding;
pub(crate) mod fourier;
mod held;
mod jumps;
mod level;
mod link;
mod noise;
mod offset;
mod spectrum;

pub use correct::correct;
pub use finding::{Finding, FindingKind, Who};
pub use link::Link;

use crate::trajectory::Recording;
use std::ops::Range;

/// What the data of one follower say about themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct Soundness {
    /// What is wrong, the gravest kinds of fault not first but in the order of the checks.
    pub findings: Vec<Finding>,
    /// What cannot be seen in these data, one sentence each.
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

/// Checks the link of a follower (1 = right behind the platoon leader) in the recording's platoon number `platoon`.
///
/// # Errors
/// When there is no such link.
pub fn check(recording: &Recording, platoon: usize, follower: usize) -> Result<Soundness, NoLink> {
    let none = || NoLink { path: recording.source.path.clone(), follower };
    let link = Link::of(recording, platoon, follower).ok_or_else(none)?;
    Ok(check_link(&link))
}

/// Checks one link.
#[must_use]
pub fn check_link(link: &Link) -> Soundness {
    let mut findings = Vec::new();
    let mut broken: Vec<Range<usize>> = Vec::new();
    for signal in link.signals() {
        let resampled = noise::resampled(&signal, link);
        let held = held::dropouts(&signal, link, resampled.as_ref().map_or(1.0, |r| r.factor));
        broken.extend(held.iter().cloned());
        findings.extend(held::finding(&signal, link, &held));
        match resampled {
            Some(found) => findings.push(found.finding),
            None => findings.extend(noise::smoothed(&signal, link)),
        }
    }
    let jumps = jumps::find(link, &broken);
    findings.extend(jumps.iter().take(jumps::LISTED).map(|jump| jump.finding(link)));
    let usable = level::Usable::new(link, &broken, &jumps);
    let mut unseen = Vec::new();
    let mut residual = None;
    match clocks::Redundancy::estimate(link, &usable) {
        Some(redundancy) => {
            let blurs = |f: &Finding| matches!(f.kind, FindingKind::Smoothed | FindingKind::Resampled);
            let blurred = findings.iter().any(blurs);
            findings.extend(redundancy.findings(link, blurred));
            residual = Some(redundancy.residual_rate_rms(link, &usable));
        }
        None => unseen.push(
            "speed scales and clock offsets: there is no stretch of driving long enough to compare gap and speeds"
                .to_owned(),
        ),
    }
    findings.extend(residual.and_then(|rms| jumps::drifting(link, rms)));
    match offset::gap_offset(link) {
        offset::Seen::Finding(finding) => findings.push(*finding),
        offset::Seen::Sound => {}
        offset::Seen::No(why) => unseen.push(why.to_owned()),
    }
    Soundness { findings, unseen, rate_rms_mps: level::rate_rms(link, &usable) }
}
