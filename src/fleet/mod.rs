//! Fleets: every pair of a data set, calibrated separately with one or several models.
//!
//! ```text
//!  pairs --(some at a time)--> calibrate_each --> rows --> batch::Journal, as soon as they are finished
//!                                                   '----> table, in the order of the pairs
//! ```
//!
//! A row depends only on its pair, model, measure and settings; threads, interruptions and the other pairs do not change it.

mod compare;
mod fits;
mod holdout;
mod table;
#[cfg(test)]
mod tests;
mod work;

pub use compare::{Comparison, HeldScore, ModelRank, Rule, compare};
pub use fits::fits;
pub use holdout::{Held, driver, kept_and_held};
pub use table::{Overview, ParameterOverview, Spread, clash, overview, table};
pub use work::{FleetError, run};

use crate::batch::{Entry, Journal, JournalError};
use crate::calibrate::{Calibration, Overrides, SearchSpace};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::identify::Optimism;
use crate::score::GoodnessOfFit;
use crate::select::Selection;
use crate::study::fingerprint;
use crate::trajectory::{Finding, Trajectory};
use crate::vehicle::Vehicle;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::path::Path;

/// Version of the files of a fleet.
pub const SCHEMA_VERSION: u32 = 1;

/// Default number of simulations of a search per searched parameter: of 500 drives of 30 to 60 s with IDM, 99 in 100 then come within 0.1 %
/// of the best score that ten times as many find (docs/benchmark/fleet.md).
pub const EVALUATIONS_PER_PARAMETER: u64 = 2_000;

/// A follower behind its leader, as in the data.
#[derive(Debug, Clone)]
pub struct Pair {
    pub file: String,
    /// Trajectory id of files that hold several.
    pub trajectory: Option<String>,
    /// Number of the follower; 1 is right behind the leader of its platoon.
    pub follower: usize,
    /// Name of the follower as in the file.
    pub name: String,
    /// Input of a calibration, or why it is missing.
    pub drive: Result<Drive, String>,
    /// True if there is none because the drive is too short.
    pub is_short: bool,
    /// Held-back data of the same driver, only scored.
    pub held: Vec<Drive>,
}

impl Pair {
    /// File, trajectory and follower, in words.
    pub fn place(&self) -> String {
        let id = self.trajectory.as_ref().map_or(String::new(), |id| format!(" trajectory {id}"));
        format!("{}{id} follower {}", self.file, self.follower)
    }

    /// The kinds of faults of its data that change a calibration with one of these measures, separated by spaces; empty if there are none.
    pub fn doubts(&self, measures: &[GoodnessOfFit]) -> String {
        let findings = self.drive.iter().flat_map(|drive| drive.trajectory.findings());
        let counts = |finding: &Finding| measures.iter().any(|measure| measure.minds(finding.kind));
        let doubtful = findings.filter(|finding| finding.matters && finding.correction.is_none() && counts(finding));
        let kinds: BTreeSet<&str> = doubtful.map(|finding| finding.kind.into_str()).collect();
        Vec::from_iter(kinds).join(" ")
    }
}

/// A drive that can be calibrated.
#[derive(Debug, Clone)]
pub struct Drive {
    /// The measured signals.
    pub trajectory: Trajectory,
    /// The follower's car, if known.
    pub vehicle: Option<Vehicle>,
}

/// A model with its bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The variant with its extensions.
    pub variant: Variant,
    /// Bounds and fixed values that replace those of Table 3.
    pub overrides: Overrides,
}

/// Settings of each pair.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Models, each calibrated on every pair.
    pub models: Vec<Model>,
    /// Measures, each minimised with every model.
    pub measures: Vec<GoodnessOfFit>,
    pub convention: Convention,
    /// Optimiser, seed and stopping rules; one replicate.
    pub calibration: Calibration,
    /// Largest number of simulations of a search, instead of that of `calibration`; `None`: [`EVALUATIONS_PER_PARAMETER`].
    pub max_evaluations: Option<u64>,
    /// Whether intervals of the parameters are estimated.
    pub intervals: bool,
    /// The choice of the evaluator.
    pub selection: Selection,
}

/// The calibration of a row: positions in the lists of pairs, models and measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct Place {
    pub pair: usize,
    pub model: usize,
    pub measure: usize,
}

/// The calibration of one pair.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Row {
    #[serde(flatten)]
    pub place: Place,
    /// The result, or why there is none.
    #[serde(flatten)]
    pub found: Result<Found, String>,
}

impl Entry for Row {
    type Key = Place;

    fn key(&self) -> &Place {
        &self.place
    }
}

/// Calibrated parameters of one pair.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Found {
    /// The minimised measure, by the f64 reference.
    pub score: f64,
    /// RMSE of spacing \[m\], speed \[m/s\] and acceleration \[m/s²\].
    pub rmse: [Option<f64>; 3],
    /// NRMSE of spacing, speed and acceleration; none for a signal that does not vary.
    pub nrmse: [Option<f64>; 3],
    /// One value per parameter of the model.
    pub parameters: Vec<f64>,
    /// Parameters within 0.1 % of their range of a bound.
    pub at_bound: Vec<String>,
    /// 95 % intervals, one per parameter; `None` if it was fixed, or the drive does not determine it.
    pub intervals: Option<Vec<Option<[f64; 2]>>>,
    /// Expected increase of the score on another drive of the same driver; `None` without intervals, or if it could not be
    /// computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub optimism: Option<Optimism>,
    /// Simulated candidates.
    pub evaluations: u64,
    /// Why the search ended.
    pub stop: String,
}

impl Settings {
    /// All calibrations, in the order of their rows.
    pub fn places(&self, pairs: usize) -> impl Iterator<Item = Place> {
        let (models, measures) = (self.models.len(), self.measures.len());
        let of_model = move |pair, model| (0..measures).map(move |measure| Place { pair, model, measure });
        (0..pairs).flat_map(move |pair| (0..models).flat_map(move |model| of_model(pair, model)))
    }

    /// Largest number of simulations of the search in a space.
    pub fn most_evaluations(&self, space: &SearchSpace) -> u64 {
        self.max_evaluations.unwrap_or(EVALUATIONS_PER_PARAMETER * space.free().len().max(1) as u64)
    }

    /// The journal of these calibrations.
    pub fn journal(&self, path: &Path, pairs: &[Pair]) -> Result<Journal<Row>, JournalError> {
        Journal::open(path, Some(&self.key(pairs)), &|line| {
            let row = serde_json::from_slice(line).map_err(|error| error.to_string())?;
            self.misfit(&row, pairs.len()).map_or(Ok(Some(row)), Err)
        })
    }

    /// The reason why a row of a journal cannot be one of these calibrations, if there is one.
    fn misfit(&self, row: &Row, pairs: usize) -> Option<String> {
        let Place { pair, model, measure } = row.place;
        let (models, measures) = (self.models.len(), self.measures.len());
        if pair >= pairs || model >= models || measure >= measures {
            return Some(format!(
                "expected one of {pairs} pairs, {models} models and {measures} measures, counted from 0"
            ));
        }
        let Ok(found) = &row.found else { return None };
        let expected = self.models[model].variant.parameters().len();
        let intervals = found.intervals.as_ref().map_or(expected, Vec::len);
        let counts = [("parameters", found.parameters.len()), ("intervals", intervals)];
        let (name, count) = counts.into_iter().find(|(_, count)| *count != expected)?;
        Some(format!("expected {expected} {name}, found {count}"))
    }

    /// Checksum of everything that rows depend on: two runs with the same one find the same rows.
    fn key(&self, pairs: &[Pair]) -> String {
        let mut hash = Sha256::new();
        let program = &*crate::calibrate::PROGRAM;
        let Settings { measures, convention, calibration, max_evaluations, intervals, selection, .. } = self;
        hash.update(format!(
            "{SCHEMA_VERSION} {program} {convention} {calibration:?} {max_evaluations:?} {intervals} {selection:?}"
        ));
        measures.iter().for_each(|measure| hash.update(format!(" {measure}")));
        for model in &self.models {
            hash.update(format!("\n{} {:?}", model.variant, model.overrides));
            model.variant.extensions.list().iter().for_each(|extension| hash.update(&extension.text));
        }
        for pair in pairs {
            hash.update(format!("\n{} {:?} {} {}", pair.file, pair.trajectory, pair.follower, pair.name));
            match &pair.drive {
                Err(reason) => hash.update(reason),
                Ok(Drive { trajectory, vehicle }) => hash.update(fingerprint(trajectory, vehicle.as_ref())),
            }
        }
        crate::trajectory::hexadecimal(&hash.finalize())
    }
}
