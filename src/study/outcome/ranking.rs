//! The variants in order: by unseen trajectories, if they were validated on any. On its own trajectory the larger of two nested variants
//! always fits better.

use super::{Behind, Outcomes, Tried};
use crate::statistics::{mean, median};

/// Variants in order, from some trajectories.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranking {
    /// True if it is by validation runs; else it is by the scores of the calibrations.
    pub unseen: bool,
    /// The variants, the lowest error first; those without an error for the ranking last.
    pub order: Vec<usize>,
    /// By variant: excess of its errors in validation over those of the first.
    pub behind: Vec<Option<Behind>>,
    /// Of the variants that cannot be distinguished from the first one in validation, the one with the fewest parameters; the first without any.
    pub chosen: Option<usize>,
}

impl Ranking {
    /// For the calibrations on the selected trajectories.
    pub fn of(outcomes: &Outcomes, wanted: &dyn Fn(usize) -> bool) -> Ranking {
        let count = outcomes.variants.len();
        let drives: Vec<usize> = (0..outcomes.drives.len()).filter(|drive| wanted(*drive)).collect();
        let unseen = |v: usize| {
            let tried = drives.iter().flat_map(|&drive| &outcomes.cells[v][drive].tried);
            median(&tried.filter_map(Tried::score).collect::<Vec<_>>())
        };
        let is_unseen = (0..count).any(|v| unseen(v).is_some());
        let error: Vec<Option<f64>> =
            (0..count).map(|v| if is_unseen { unseen(v) } else { outcomes.mean_score(v, wanted) }).collect();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| error[a].unwrap_or(f64::INFINITY).total_cmp(&error[b].unwrap_or(f64::INFINITY)));
        let first = order.first().copied().filter(|&first| error[first].is_some());
        let behind: Vec<Option<Behind>> = match first.filter(|_| is_unseen) {
            Some(first) => (0..count).map(|v| behind(outcomes, &drives, v, first)).collect(),
            None => vec![None; count],
        };
        let open = (0..count).filter(|&v| behind[v].is_some_and(|behind| behind.is_open()));
        let size = |v: usize| outcomes.variants[v].parameters().len();
        let place = |v: usize| order.iter().position(|other| *other == v);
        let chosen = open.min_by_key(|&v| (size(v), place(v))).or(first);
        Ranking { unseen: is_unseen, order, behind, chosen }
    }

    /// The variants that cannot be distinguished from the chosen one.
    pub fn open(&self) -> Vec<usize> {
        let is_open = |v: &&usize| self.behind[**v].is_some_and(|behind| behind.is_open());
        self.order.iter().filter(is_open).copied().filter(|v| Some(*v) != self.chosen).collect()
    }
}

/// Excess of the errors of a variant over those of another one, over the validation runs that both complete. Runs of the same calibration
/// depend on each other, so that a trajectory counts once.
fn behind(outcomes: &Outcomes, drives: &[usize], variant: usize, other: usize) -> Option<Behind> {
    let of_drive = |&drive: &usize| {
        let [own, others] = [variant, other].map(|v| &outcomes.cells[v][drive].tried);
        let both = own.iter().zip(others).filter_map(|(own, other)| Some((own.score()?, other.score()?)));
        let ratios = both.filter(|(own, other)| *own > 0.0 && *other > 0.0).map(|(own, other)| (own / other).ln());
        mean(&ratios.collect::<Vec<_>>())
    };
    Behind::of(&drives.iter().filter_map(of_drive).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::Variant;
    use crate::study::outcome::{Cell, DriveName};

    fn outcomes(unseen: impl Fn(usize, usize) -> Option<f64>) -> Outcomes {
        let variants: Vec<Variant> = ["idm", "idm+delay"].map(|name| name.parse().expect("a variant")).into();
        let drives = (0..6).map(|k| DriveName { platoon: format!("P{k}"), follower: 1, vehicle: "one".to_owned() });
        let drives: Vec<DriveName> = drives.collect();
        let cell = |v: usize, drive: usize| Cell {
            // On its own sample, the larger one is always better.
            score: Some(0.5 - 0.1 * v as f64),
            tried: unseen(v, drive).map(|error| Tried::Errors([error; 4])).into_iter().collect(),
            ..Cell::default()
        };
        let cells = (0..2).map(|v| (0..6).map(|drive| cell(v, drive)).collect()).collect();
        Outcomes { gof: "nrmse-sva".to_owned(), drives, variants, cells }
    }

    #[test]
    fn the_larger_of_nested_variants_has_to_earn_it() {
        let wobble = |drive: usize| 0.01 * (drive as f64 - 2.5);
        let even =
            Ranking::of(&outcomes(|v, drive| Some(0.6 + v as f64 * wobble(drive) - v as f64 * 0.001)), &|_| true);
        assert_eq!((even.unseen, even.chosen, even.open()), (true, Some(0), vec![1]), "{even:?}");
        let earned = Ranking::of(&outcomes(|v, drive| Some(0.6 - v as f64 * (0.1 + wobble(drive)))), &|_| true);
        assert_eq!((earned.order.clone(), earned.chosen, earned.open()), (vec![1, 0], Some(1), vec![]), "{earned:?}");
        let alone = Ranking::of(&outcomes(|_, _| None), &|_| true);
        assert_eq!((alone.unseen, alone.chosen, alone.open()), (false, Some(1), vec![]), "{alone:?}");
        // One trajectory shows no spread over trajectories.
        let one = Ranking::of(&outcomes(|v, _| Some(0.6 - 0.1 * v as f64)), &|drive| drive == 0);
        assert_eq!((one.chosen, one.open()), (Some(0), vec![1]), "{one:?}");
    }
}
