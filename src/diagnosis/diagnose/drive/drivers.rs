//! Detects files of different drivers that are given as one car.

use super::Drive;
use crate::calibrate::{Apart, BoundSet, Overrides, SearchSpace, apart};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::{Case, EvaluateError};

/// The name of the finding.
pub const DIFFERENT: &str = "different_drivers";

/// Drives that probably have different drivers or settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Different {
    /// Error of the gap predicted from all drives, relative to that predicted from the other half of the same drive.
    pub ratio: f64,
    /// The file that differs.
    pub file: String,
    /// The message.
    pub sentence: String,
}

/// Reports drives that probably have different drivers or settings, by the law of the base; a drive on which it cannot run is left out.
///
/// # Errors
/// When the evaluator fails.
pub fn different_drivers(
    drives: &[&Drive],
    base: Variant,
    bounds: &Overrides,
    seed: u64,
) -> Result<Option<Different>, EvaluateError> {
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
        ratio: apart.other_m / apart.own_m,
        file: usable[apart.values.last().map_or(0, |(drive, _)| *drive)].0.file().to_owned(),
        sentence: apart.told(&space, &labels),
    };
    Ok(apart(&cases, &space, seed)?.map(entry))
}
