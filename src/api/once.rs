//! Drives that are given twice: their samples would count twice, and the intervals would be too narrow.

use super::error::{Usage, refuse};
use crate::study::fingerprint;
use crate::trajectory::Trajectory;
use std::fmt;

/// Fingerprint that shows whether two drives have samples in common.
#[derive(Debug, Clone)]
pub(crate) struct Samples {
    path: String,
    label: String,
    fingerprint: String,
    sha256: String,
    follower: (usize, String, Option<String>),
    window_s: [f64; 2],
}

impl Samples {
    pub(crate) fn of(trajectory: &Trajectory) -> Samples {
        let Trajectory { label, source, follower, name, id, t, .. } = trajectory;
        Samples {
            path: source.path.clone(),
            label: label.clone(),
            fingerprint: fingerprint(trajectory, None),
            sha256: source.sha256.clone(),
            follower: (*follower, name.clone(), id.clone()),
            window_s: [t[0], t[t.len() - 1]],
        }
    }

    /// True for the same signals, whatever their source, and for one follower of one file at overlapping times.
    pub(crate) fn overlap(&self, other: &Samples) -> bool {
        let ([from, to], [other_from, other_to]) = (self.window_s, other.window_s);
        let same_follower = self.sha256 == other.sha256 && self.follower == other.follower;
        self.fingerprint == other.fingerprint || (same_follower && from <= other_to && other_from <= to)
    }

    /// Refuses this drive if an earlier one has the same samples.
    pub(crate) fn differ_from(&self, before: &[Samples]) -> Result<(), Usage> {
        match before.iter().find(|other| self.overlap(other)) {
            None => Ok(()),
            Some(other) if other.to_string() == self.to_string() => {
                refuse!("{self} is given twice, and would count twice; give it once");
            }
            Some(other) => {
                refuse!("{self} has samples of {other}, which would count twice; leave one of the two out");
            }
        }
    }
}

impl fmt::Display for Samples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.path, self.label)
    }
}

/// Refuses drives if one has samples of another.
pub(crate) fn once<'a>(drives: impl IntoIterator<Item = &'a Trajectory>) -> anyhow::Result<()> {
    let mut seen: Vec<Samples> = Vec::new();
    for drive in drives {
        let own = Samples::of(drive);
        own.differ_from(&seen)?;
        seen.push(own);
    }
    Ok(())
}
