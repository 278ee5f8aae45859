//! Detects files of different drivers that are given as one car.

use super::Drive;
use crate::calibrate::{Apart, BoundSet, Overrides, SearchSpace, apart};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::{Case, EvaluateError};
use crate::text::option::{FOLLOWER, in_file};
use crate::trajectory::{Trajectory, different_names};

/// The name of the finding.
pub const DIFFERENT: &str = "different_drivers";

/// Drives that probably have different drivers or settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Different {
    /// Error of the gap predicted from all drives, relative to that predicted from the other half of the same drive; or the number of
    /// followers that the files name.
    pub size: f64,
    /// `times` or `followers`.
    pub unit: &'static str,
    /// The file that differs.
    pub file: String,
    /// The message.
    pub sentence: String,
}

/// Reports drives that have different drivers or settings, by the names in their files, otherwise by the law of the base; a drive on which
/// it cannot run is left out.
///
/// # Errors
/// When the evaluator fails.
pub fn different_drivers(
    drives: &[&Drive],
    base: Variant,
    bounds: &Overrides,
    seed: u64,
) -> Result<Option<Different>, EvaluateError> {
    let trajectories: Vec<&Trajectory> = drives.iter().map(|drive| &drive.trajectory).collect();
    if let Some((count, names)) = different_names(&trajectories) {
        let file = drives.first().map_or(String::new(), |drive| drive.file().to_owned());
        let sentence = in_file(|| format!("{names}; {FOLLOWER} NAME selects one"));
        return Ok(Some(Different { size: count as f64, unit: "followers", file, sentence }));
    }
    // Wide bounds: with values on a bound, two drivers look alike.
    let mut wide = BoundSet::Human.overrides(&base);
    wide.extend(bounds.clone());
    let usable: Vec<(&Drive, Case)> =
        drives.iter().filter_map(|drive| Some((*drive, drive.case(base, &wide).ok()?))).collect();
    let vehicle = drives.iter().find_map(|drive| drive.vehicle.as_deref());
    let Ok(space) = SearchSpace::new(&base, vehicle, Convention::PAPER, &wide) else { return Ok(None) };
    let cases: Vec<Case> = usable.iter().map(|(_, case)| case.clone()).collect();
    let labels: Vec<&str> = usable.iter().map(|(drive, _)| drive.label()).collect();
    let entry = |apart: Apart| Different {
        size: apart.other_m / apart.own_m,
        unit: "times",
        file: usable[apart.values.last().map_or(0, |(drive, _)| *drive)].0.file().to_owned(),
        sentence: apart.told(&space, &labels),
    };
    Ok(apart(&cases, &space, seed)?.map(entry))
}
