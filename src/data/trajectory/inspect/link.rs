//! One link of two cars: does the measured gap agree with the two speeds?

use crate::trajectory::soundness::{Finding, Link, check_platoon, gap_column};
use crate::trajectory::{Car, Platoon, Recording};
use serde::Serialize;

/// One link, named after the follower's car number.
#[derive(Debug, Clone, Serialize)]
pub struct LinkInspection {
    pub follower_car: usize,
    /// Column of the gap in the file.
    pub signal: String,
    /// Gap rate minus speed difference over a second, where nothing is missing, held or jumping.
    pub gap_rate_rms_mps: Option<f64>,
    /// Faults of the signals.
    pub findings: Vec<Finding>,
    /// Faults that these data cannot show, one sentence each.
    pub unseen: Vec<String>,
}

pub(super) fn inspect(lead: &Car, ego: &Car, platoon: &Platoon, recording: &Recording) -> Option<LinkInspection> {
    ego.gap.as_ref()?;
    let checked = Link::of(recording, platoon, lead.number, [None; 2]).map(|link| check_platoon(platoon, &link));
    let (findings, unseen, gap_rate_rms_mps) =
        checked.map_or_else(Default::default, |found| (found.findings, found.unseen, found.rate_rms_mps));
    let signal = gap_column(ego.number, recording.layout);
    Some(LinkInspection { follower_car: ego.number, signal, gap_rate_rms_mps, findings, unseen })
}
