//! Files of different drivers that are given as one car.

use super::Drive;
use crate::calibrate::{Apart, BoundSet, Overrides, SearchSpace, apart};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::{Case, EvaluateError};

/// The name of the finding.
pub const DIFFERENT: &str = "different_drivers";

/// Drives that are hardly of one driver with one setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Different {
    /// How many times as large the gap's error is by what other drives tell as by what the other half of the drive tells.
    pub ratio: f64,
    /// The file that differs.
    pub file: String,
    /// In words.
    pub sentence: String,
}

/// Says so where the drives are hardly of one driver with one setting, by the law of the base; a drive that it cannot run on is left out.
///
/// # Errors
/// When the evaluator fails.
pub fn different_drivers(
    drives: &[&Drive],
    base: Variant,
    bounds: &Overrides,
    seed: u64,
) -> Result<Option<Different>, EvaluateError> {
    // Wide ones: on a bound two drivers look alike.
    let mut wide = BoundSet::Human.overrides(&base);
    wide.extend(bounds.clone());
    let usable: Vec<(&Drive, Case)> =
        drives.iter().filter_map(|drive| Some((*drive, drive.case(base, &wide).ok()?))).collect();
    let vehicle = drives.iter().find_map(|drive| drive.vehicle.as_deref());
    let Ok(space) = SearchSpace::new(&base, vehicle, Convention::PAPER, &wide) else { return Ok(None) };
    let cases: Vec<Case> = usable.iter().map(|(_, case)| case.clone()).collect();
    let labels: Vec<&str> = usable.iter().map(|(drive, _)| drive.label()).collect();
    let entry = |apart: Apart| Different {
        ratio: apart.other_m / apart.own_m,
        file: usable[apart.values.last().map_or(0, |(drive, _)| *drive)].0.file().to_owned(),
        sentence: apart.told(&space, &labels),
    };
    Ok(apart(&cases, &space, seed)?.map(entry))
}
