//! The paper's Tables 4 and 5, computed from a study.

use super::{Errors, Outcomes, Tried};
use crate::statistics::median;

/// A variant in Table 4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table4Row {
    /// Median of the normalised calibration error (Eq. 19) over the trajectories.
    pub median: Option<f64>,
    /// Its change against the base model \[%\].
    pub change: Option<f64>,
}

/// A variant in Table 5: median changes of RMSE(s), RMSE(v), RMSE(a), NRMSE(s,v,a) against the base model \[%\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table5Row {
    /// Over the calibrations.
    pub calibration: [Option<f64>; 4],
    /// Over the validation runs that reach the end with every variant of the base model.
    pub validation: [Option<f64>; 4],
    /// Number of those runs.
    pub common: usize,
    /// Validation runs that ended in a collision.
    pub collisions: usize,
    /// Validation runs that ended early for another reason.
    pub other_ends: usize,
    /// Validation runs.
    pub runs: usize,
}

/// Both tables, one row per variant of the study.
pub fn compare(outcomes: &Outcomes) -> (Vec<Table4Row>, Vec<Table5Row>) {
    let count = outcomes.variants.len();
    let medians: Vec<Option<f64>> = (0..count).map(|i| median(&outcomes.normalized(i))).collect();
    let four = (0..count).map(|i| {
        let base = outcomes.base_of(i).filter(|base| *base != i).and_then(|base| medians[base]);
        // A base model that is the best everywhere has no change to compare.
        let change = medians[i].zip(base).map(|(own, base)| 100.0 * (own - base) / base).filter(|x| x.is_finite());
        Table4Row { median: medians[i], change }
    });
    (four.collect(), (0..count).map(|i| five(outcomes, i)).collect())
}

fn five(outcomes: &Outcomes, variant: usize) -> Table5Row {
    let (collisions, other_ends, runs) = outcomes.collisions(variant);
    let common = common_runs(outcomes, variant);
    let mut row =
        Table5Row { calibration: [None; 4], validation: [None; 4], common: common.len(), collisions, other_ends, runs };
    let Some(base) = outcomes.base_of(variant).filter(|base| *base != variant) else { return row };
    let calibrated = (0..outcomes.drives.len()).filter_map(|drive| {
        let best = |variant: usize| outcomes.cells[variant][drive].best;
        Some((best(variant)?, best(base)?))
    });
    row.calibration = changes(&calibrated.collect::<Vec<_>>());
    let tried = |variant: usize, (drive, run): (usize, usize)| match outcomes.cells[variant][drive].tried.get(run) {
        Some(Tried::Errors(errors)) => Some(*errors),
        _ => None,
    };
    let validated = common.iter().filter_map(|&at| Some((tried(variant, at)?, tried(base, at)?)));
    row.validation = changes(&validated.collect::<Vec<_>>());
    row
}

/// Medians of the changes of each error \[%\].
fn changes(pairs: &[(Errors, Errors)]) -> [Option<f64>; 4] {
    [0, 1, 2, 3].map(|i| {
        let change = |(own, base): &(Errors, Errors)| 100.0 * (own[i] - base[i]) / base[i];
        median(&pairs.iter().map(change).filter(|x| x.is_finite()).collect::<Vec<_>>())
    })
}

/// Validation runs, by trajectory and number, that reach the end with every variant of the same base model.
fn common_runs(outcomes: &Outcomes, variant: usize) -> Vec<(usize, usize)> {
    let class = outcomes.class(outcomes.variants[variant].base.name);
    let ends_well = |drive: usize, run: usize| {
        class.iter().all(|&i| matches!(outcomes.cells[i][drive].tried.get(run), Some(Tried::Errors(_))))
    };
    let runs = |drive: usize| outcomes.cells[variant][drive].tried.len();
    (0..outcomes.drives.len())
        .flat_map(|drive| (0..runs(drive)).map(move |run| (drive, run)))
        .filter(|&(drive, run)| ends_well(drive, run))
        .collect()
}
