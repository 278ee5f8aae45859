//! The data of a diagnosis in its file: files, faults, drives and errors.

use crate::diagnose::data::{Finding, FindingKind, Soundness};
use crate::diagnose::drive::drivers::{DIFFERENT, Different};
use crate::trajectory::{Trajectory, different_names};
use serde::{Deserialize, Serialize};

/// A fault of the data.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FindingEntry {
    /// Kind of fault.
    pub name: String,
    /// `leader`, `follower` or `both`; `leader or follower` if the data do not show which.
    pub car: String,
    /// `speed` or `gap`.
    pub signal: String,
    /// Its size.
    pub value: f64,
    pub unit: String,
    /// 95 % interval.
    pub interval: Option<[f64; 2]>,
    pub file: String,
    /// Id of the trajectory, if the file has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<String>,
    /// Stretches of the file's time \[s\]; empty: the whole file.
    #[serde(rename = "when_s")]
    pub when: Vec<[f64; 2]>,
    /// Line of the file at which it begins; `None` if it affects the whole file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<u64>,
    /// Whether it biases calibrated parameters.
    #[serde(default)]
    pub matters: bool,
    /// Its effect on parameters, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effect: Option<String>,
    /// Options that correct or avoid it, with their values: `correct`, `to 69.9`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remedies: Vec<String>,
    /// In words.
    pub sentence: String,
    /// The correction, if one was requested.
    pub correction: Option<String>,
}

impl FindingEntry {
    /// The sentence with the effect of the fault on parameters.
    #[must_use]
    pub fn told(&self) -> String {
        let effect = self.effect.as_ref().map_or_else(String::new, |effect| format!("; {effect}"));
        format!("{}{effect}", self.sentence)
    }

    /// A finding of drives with different drivers.
    #[must_use]
    pub fn different(found: Different) -> FindingEntry {
        FindingEntry {
            name: DIFFERENT.to_owned(),
            car: "follower".to_owned(),
            signal: "gap".to_owned(),
            value: found.ratio,
            unit: "times".to_owned(),
            file: found.file,
            matters: true,
            sentence: found.sentence,
            ..FindingEntry::default()
        }
    }

    /// A finding of drives that name different followers or drivers.
    #[must_use]
    pub fn different_names(drives: &[&Trajectory]) -> Option<FindingEntry> {
        let (count, sentence) = different_names(drives)?;
        let file = drives.first().map_or(String::new(), |drive| drive.source.path.clone());
        let found = Different { ratio: count as f64, file, sentence };
        Some(FindingEntry { unit: "names".to_owned(), ..FindingEntry::different(found) })
    }

    /// True for a finding of this drive, or of its whole file.
    #[must_use]
    pub fn is_of(&self, drive: &DataEntry) -> bool {
        self.file == drive.path && (self.trajectory.is_none() || self.trajectory == drive.trajectory)
    }

    /// True if this is a constant error too small to change a calibration.
    #[must_use]
    pub fn is_minor(&self) -> bool {
        let constants = [FindingKind::SpeedScale, FindingKind::GapOffset, FindingKind::ClockOffset];
        let is_constant = constants.into_iter().any(|kind| kind.into_str() == self.name);
        is_constant && !self.matters && self.correction.is_none()
    }

    /// The findings of the data check for a trajectory.
    #[must_use]
    pub fn of(trajectory: &Trajectory) -> Vec<FindingEntry> {
        trajectory.findings().map(|finding| FindingEntry::new(trajectory, finding)).collect()
    }

    /// A finding of a trajectory, with its correction.
    #[must_use]
    pub fn new(trajectory: &Trajectory, finding: &Finding) -> FindingEntry {
        FindingEntry {
            name: finding.kind.into_str().to_owned(),
            car: finding.car.into_str().to_owned(),
            signal: finding.signal.to_owned(),
            value: finding.value,
            unit: finding.unit.to_owned(),
            interval: finding.interval,
            file: trajectory.source.path.clone(),
            trajectory: trajectory.id.clone(),
            when: finding.when.clone(),
            line: finding.line,
            matters: finding.matters,
            effect: finding.matters.then(|| finding.kind.effect().to_owned()),
            remedies: finding.remedies.iter().map(crate::trajectory::Remedy::named).collect(),
            sentence: finding.sentence.clone(),
            correction: finding.correction.clone(),
        }
    }
}

/// One data file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataEntry {
    /// Path as given.
    pub path: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// The follower's number in it; 0 if it stands for all of them, as in a fleet.
    pub follower: usize,
    /// The follower's name.
    pub name: String,
    /// Id of the trajectory, if the file names its trajectories.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<String>,
    /// `train` or `holdout`.
    pub role: String,
    /// Window that is used \[s\], in the file's own time.
    pub window_s: [f64; 2],
    pub samples: usize,
    /// Gap rate minus speed difference over a second, rms \[m/s\].
    pub gap_rate_rms_mps: Option<f64>,
    /// Faults that these data cannot show.
    pub unseen: Vec<String>,
    /// The message if gap and speeds are in units that contradict each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<String>,
    /// Displacement along the road \[m\], to where its grade matches that of the first file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moved_m: Option<f64>,
}

impl DataEntry {
    /// The number of its follower; `None` if it stands for all followers of the file.
    #[must_use]
    pub fn follower(&self) -> Option<usize> {
        Some(self.follower).filter(|follower| *follower > 0)
    }

    /// True if it only tests the result.
    #[must_use]
    pub fn is_held_back(&self) -> bool {
        self.role == "holdout"
    }

    /// A trajectory, before the check of its data.
    #[must_use]
    pub fn of(trajectory: &Trajectory, role: &str) -> DataEntry {
        DataEntry {
            path: trajectory.source.path.clone(),
            sha256: trajectory.source.sha256.clone(),
            follower: trajectory.follower,
            name: trajectory.name.clone(),
            trajectory: trajectory.id.clone(),
            role: role.to_owned(),
            window_s: [trajectory.t[0], trajectory.t[trajectory.len() - 1]],
            samples: trajectory.len(),
            gap_rate_rms_mps: None,
            unseen: Vec::new(),
            units: None,
            moved_m: None,
        }
    }

    /// The message about the displacement.
    #[must_use]
    pub fn moved(&self) -> Option<String> {
        let told = |by| {
            format!(
                "moved along the road by {by:+.0} m, to where its grade matches that of the first file; at its own positions it does not"
            )
        };
        self.moved_m.map(told)
    }

    /// Adds the results of the data check.
    pub fn take(&mut self, soundness: &Soundness) {
        self.gap_rate_rms_mps = soundness.rate_rms_mps;
        self.unseen.clone_from(&soundness.unseen);
    }
}

/// A drive: a file, or a piece of one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveEntry {
    /// File, follower, piece.
    pub label: String,
    /// `train` or `holdout`.
    pub role: String,
}

/// Errors of a model on a drive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ErrorsEntry {
    /// Root mean square error of spacing \[m\], speed \[m/s\] and acceleration \[m/s²\].
    pub rms: [f64; 3],
    /// NRMSE(s,v,a).
    pub nrmse_sva: f64,
}

/// The base model and the recommended one on data that they were not fitted to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeldBackEntry {
    /// The file, each part of which was left out of a fit; or the held-back drive, as in `drives`.
    pub label: String,
    /// Root mean square error of spacing \[m\], speed \[m/s\] and acceleration \[m/s²\]; none if the simulation ends early.
    pub rms: Option<[f64; 3]>,
    /// NRMSE(s,v,a) of the same run.
    pub nrmse_sva: Option<f64>,
    /// The errors of the recommended model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recommended: Option<ErrorsEntry>,
}

/// True if data contradict themselves, or have several drivers, so that no verdict is reliable.
#[must_use]
pub fn has_bad_data(data: &[DataEntry], findings: &[FindingEntry]) -> bool {
    data.iter().any(|entry| entry.units.is_some())
        || findings.iter().any(|f| {
            let unrelated = f.name == "inconsistent" && f.unit == "m/s";
            unrelated || [DIFFERENT, "exchanged", "unit"].contains(&f.name.as_str())
        })
}
