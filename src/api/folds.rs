//! Cross-validation of one parameter set for many drives: each driver is left out of one calibration.

use super::calibration::{Calibration, Prepared};
use super::error::refuse;
use super::loading::Loaded;
use crate::calibrate::{self, Progress};
use crate::result::assemble::scores_on;
use crate::result::{DriveScore, Scores};
use crate::text::option::FOLDS;
use crate::trajectory::{Trajectory, driver_id};
use indexmap::IndexSet;
use std::ops::ControlFlow;

/// Smallest number of folds: with one, nothing is left to calibrate on.
const LEAST: u64 = 2;

/// Warning that a fold failed.
pub(crate) fn lost(error: &anyhow::Error) -> String {
    format!("{FOLDS}: {error:#}; the result has no scores of left-out drivers")
}

/// The driver of each drive, numbered in their order; without an id, each drive has another driver.
pub(crate) fn drivers_of(loaded: &[Loaded]) -> Vec<usize> {
    let mut drivers = IndexSet::new();
    let driver = |(k, one): (usize, &Loaded)| {
        let id = driver_id(&one.trajectory.name, one.trajectory.id.as_deref());
        drivers.insert_full(id.map_or_else(|| Err(k), |id| Ok(id.to_owned()))).0
    };
    loaded.iter().enumerate().map(driver).collect()
}

impl Calibration {
    /// The fold of each drive; `None` without cross-validation. All drives of a driver are in one fold; without an id, each drive has
    /// another driver.
    ///
    /// # Errors
    /// If there are fewer drivers than folds.
    pub(crate) fn fold_of(&self, loaded: &[Loaded]) -> anyhow::Result<Option<Vec<usize>>> {
        let Some(folds) = self.folds else { return Ok(None) };
        if folds < LEAST {
            refuse!("{FOLDS} {folds}: expected at least {LEAST}");
        }
        let of = drivers_of(loaded);
        let found = of.iter().max().map_or(0, |last| last + 1);
        if (found as u64) < folds {
            refuse!("{FOLDS} {folds}: expected at least {folds} drivers, found {found}");
        }
        Ok(Some(of.into_iter().map(|driver| driver % folds as usize).collect()))
    }

    /// Scores of all drives, each with the parameters of the calibration that leaves its driver out; `None` without cross-validation, or
    /// if `progress` breaks.
    ///
    /// # Errors
    /// As a calibration.
    pub(crate) fn left_out(
        &self,
        loaded: &[Loaded],
        progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    ) -> anyhow::Result<Option<Scores>> {
        let Some(folds) = self.fold_of(loaded)? else { return Ok(None) };
        let search = calibrate::Calibration { replicates: 1, ..self.search };
        let one = Calibration { intervals: false, search, ..self.clone() };
        let mut scores: Vec<Option<DriveScore>> = vec![None; loaded.len()];
        for fold in 0..self.folds.unwrap_or_default() as usize {
            let of = |left_out: bool| -> Vec<Loaded> {
                let those = loaded.iter().zip(&folds).filter(|(_, own)| (**own == fold) == left_out);
                those.map(|(one, _)| one.clone()).collect()
            };
            let [kept, left] = [of(false), of(true)];
            let prepared = one.prepare(&kept)?;
            let mut evaluator = one.build(&prepared.reference)?;
            let mut stopped = false;
            let found = one.search(evaluator.as_mut(), &prepared, &kept, &mut |step| {
                let flow = progress(step);
                stopped |= flow.is_break();
                flow
            });
            if stopped {
                return Ok(None);
            }
            let parameters = found?.calibrated_variant()?.parameters;
            let Prepared { reference, .. } = one.prepare(&left)?;
            let trajectories: Vec<&Trajectory> = left.iter().map(|one| &one.trajectory).collect();
            let of_fold = scores_on(&reference, &parameters, &trajectories, &self.gof).drives;
            let places = folds.iter().enumerate().filter(|(_, own)| **own == fold).map(|(k, _)| k);
            places.zip(of_fold).for_each(|(k, score)| scores[k] = Some(score));
        }
        Ok(Some(Scores { folds: self.folds, ..Scores::new(scores.into_iter().flatten().collect()) }))
    }
}
