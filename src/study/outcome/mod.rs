//! Results of a study, as in the paper's Sections 5 and 6.

mod behind;
pub mod claims;
mod compare;
mod ranking;

pub use behind::{Behind, between};
pub use compare::{Table4Row, Table5Row, compare};
pub use ranking::Ranking;

use super::folder::StudyFile;
use super::inventory::Inventory;
use super::part::{Part, RunRow};
use super::task::{Task, without_extensions};
use crate::calibrate::coefficient_of_variation;
use crate::catalog::{BASES, Base, Variant};
use crate::extension::Extension;
use crate::score::Measures;
use crate::statistics::mean;

/// A trajectory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriveName {
    pub platoon: String,
    /// 1 = right behind the platoon leader.
    pub follower: usize,
    /// The follower's vehicle.
    pub vehicle: String,
}

/// Errors of one run: RMSE of spacing \[m\], speed \[m/s\], acceleration \[m/s²\], and NRMSE(s,v,a).
pub type Errors = [f64; 4];

/// A run of a winner on another trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tried {
    /// It reached the end.
    Errors(Errors),
    /// The spacing was 0 or less.
    Collision,
    /// It ended early for another reason: no speed is safe, or a state is not finite.
    OtherEnd,
}

impl Tried {
    /// NRMSE(s,v,a) of a run that reached the end.
    pub fn score(&self) -> Option<f64> {
        if let Tried::Errors([.., score]) = self { Some(*score) } else { None }
    }
}

/// The calibrations of one variant on one trajectory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cell {
    /// Scores of the replicates with a feasible candidate.
    pub scores: Vec<f64>,
    pub best: Option<Errors>,
    /// The best score.
    pub score: Option<f64>,
    /// Parameters that the best one has on a bound.
    pub at_bound: Vec<String>,
    /// Validation runs of the best one, in the order of the plan.
    pub tried: Vec<Tried>,
}

/// All calibrations of one goodness of fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcomes {
    /// The minimised measure.
    pub gof: String,
    /// The trajectories, in the order of the plan.
    pub drives: Vec<DriveName>,
    /// The variants, in the order of the plan; extensions, which all variants of a study share, are left out.
    pub variants: Vec<Variant>,
    /// One row per variant, one cell per trajectory.
    pub cells: Vec<Vec<Cell>>,
}

impl Outcomes {
    /// All available outcomes, of each goodness of fit of a study.
    pub fn of_study(study: &StudyFile, tasks: &[Task], inventory: &Inventory) -> Vec<Outcomes> {
        let laws = study.read_laws();
        study.gofs.iter().map(|gof| Outcomes::gather(tasks, inventory, gof, &laws)).collect()
    }

    fn gather(tasks: &[Task], inventory: &Inventory, gof: &str, laws: &[&'static Extension]) -> Outcomes {
        let (mut drives, mut variants): (Vec<DriveName>, Vec<Variant>) = (Vec::new(), Vec::new());
        let mut found: Vec<(usize, usize, &Part)> = Vec::new();
        for (task, part) in tasks.iter().zip(&inventory.parts) {
            let Some(part) = part.as_ref().filter(|_| task.gof == gof) else { continue };
            let Some(variant) = without_extensions(&task.variant, laws) else { continue };
            let vehicle = part.calibration.vehicle.clone();
            let drive = DriveName { platoon: task.platoon.clone(), follower: task.follower, vehicle };
            found.push((place(&mut variants, variant), place(&mut drives, drive), part));
        }
        // In the order of the plan, whichever parts are present.
        let planned = |drive: &DriveName| {
            tasks.iter().position(|task| task.platoon == drive.platoon && task.follower == drive.follower)
        };
        let mut order: Vec<usize> = (0..drives.len()).collect();
        order.sort_by_key(|&i| planned(&drives[i]));
        let mut cells = vec![vec![Cell::default(); drives.len()]; variants.len()];
        for (variant, drive, part) in found {
            let place = order.iter().position(|&i| i == drive).expect("a permutation");
            add(&mut cells[variant][place], part);
        }
        let drives = order.into_iter().map(|i| drives[i].clone()).collect();
        Outcomes { gof: gof.to_owned(), drives, variants, cells }
    }

    /// Index of the base model of a variant, if it is part of the study.
    pub fn base_of(&self, variant: usize) -> Option<usize> {
        let name = self.variants[variant].base.name;
        self.variants.iter().position(|v| v.name() == name)
    }

    /// The base models: those of Table 1 in its order, then laws in that of the plan.
    pub fn bases(&self) -> Vec<Base> {
        let is_here = |base: &&Base| self.variants.iter().any(|v| v.base == **base);
        let mut bases: Vec<Base> = BASES.iter().filter(is_here).copied().collect();
        for variant in &self.variants {
            if !bases.contains(&variant.base) {
                bases.push(variant.base);
            }
        }
        bases
    }

    /// Indices of the variants of a base model.
    pub fn class(&self, base: &str) -> Vec<usize> {
        (0..self.variants.len()).filter(|&i| self.variants[i].base.name == base).collect()
    }

    /// Smallest and largest score of a trajectory among all variants.
    pub fn range(&self, drive: usize) -> Option<[f64; 2]> {
        let scores = self.cells.iter().filter_map(|row| row[drive].score);
        scores.fold(None, |range: Option<[f64; 2]>, x| {
            Some(range.map_or([x, x], |[low, high]| [low.min(x), high.max(x)]))
        })
    }

    /// Eq. 19: scores of a variant over the smallest one of each trajectory, minus 1.
    pub fn normalized(&self, variant: usize) -> Vec<f64> {
        let of = |drive: usize| {
            let [lowest, _] = self.range(drive)?;
            Some((self.cells[variant][drive].score? - lowest) / lowest)
        };
        (0..self.drives.len()).filter_map(of).collect()
    }

    /// Mean score of a variant over the selected trajectories, if it has one on each of them.
    pub fn mean_score(&self, variant: usize, wanted: &dyn Fn(usize) -> bool) -> Option<f64> {
        let drives = (0..self.drives.len()).filter(|drive| wanted(*drive));
        let scores: Option<Vec<f64>> = drives.map(|drive| self.cells[variant][drive].score).collect();
        mean(&scores?)
    }

    /// Coefficients of variation of a variant's scores over its replicates, one per trajectory with at least two.
    pub fn variations(&self, variant: usize) -> Vec<f64> {
        self.cells[variant].iter().filter_map(|cell| coefficient_of_variation(cell.scores.iter().copied())).collect()
    }

    /// Collisions, other early ends, and number of validation runs of a variant.
    pub fn collisions(&self, variant: usize) -> (usize, usize, usize) {
        let tried = || self.cells[variant].iter().flat_map(|cell| &cell.tried);
        let count = |end: Tried| tried().filter(|t| **t == end).count();
        (count(Tried::Collision), count(Tried::OtherEnd), tried().count())
    }
}

fn place<T: PartialEq>(list: &mut Vec<T>, item: T) -> usize {
    list.iter().position(|known| *known == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    })
}

fn add(cell: &mut Cell, part: &Part) {
    let Some(score) = part.calibration.score else { return };
    cell.scores.push(score);
    // Of equal replicates the first, as in the tables.
    if cell.score.is_none_or(|best| score < best) {
        cell.score = Some(score);
        cell.best = part.calibration.run.as_ref().and_then(errors);
        cell.at_bound.clone_from(&part.calibration.at_bound);
        cell.tried = part.validations.iter().map(|row| tried(&row.run)).collect();
    }
}

fn errors(run: &RunRow) -> Option<Errors> {
    let measure = |name: &str| {
        let i = Measures::NAMES.iter().position(|n| *n == name)?;
        run.measures.get(i).copied().flatten()
    };
    Some([measure("rmse_s")?, measure("rmse_v")?, measure("rmse_a")?, measure("nrmse_sva")?])
}

fn tried(run: &RunRow) -> Tried {
    match (run.fail_reason.as_deref(), errors(run)) {
        (Some("spacing"), _) => Tried::Collision,
        (None, Some(errors)) => Tried::Errors(errors),
        _ => Tried::OtherEnd,
    }
}
