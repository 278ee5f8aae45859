//! The validation matrix: calibration on one trajectory of a vehicle, simulation on another.

use crate::score::Measures;
use crate::statistics::median;
use crate::study::inventory::Inventory;
use crate::study::part::RunRow;
use std::collections::BTreeMap;

/// A trajectory: platoon and follower.
pub type Place = (String, usize);

/// All winners of one trajectory, simulated on one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cross {
    /// NRMSE(s,v,a) of the runs that reached the end.
    pub scores: Vec<f64>,
    /// Runs with a spacing of 0 or less.
    pub collisions: usize,
    pub runs: usize,
}

impl Cross {
    fn add(&mut self, run: &RunRow) {
        let index = Measures::NAMES.iter().position(|name| *name == "nrmse_sva");
        self.scores.extend(index.and_then(|i| run.measures.get(i).copied().flatten()));
        self.collisions += usize::from(run.fail_reason.as_deref() == Some("spacing"));
        self.runs += 1;
    }

    /// Median over the variants.
    pub fn median(&self) -> Option<f64> {
        median(&self.scores)
    }
}

/// Per vehicle, in the order of their names: the trajectories, and the simulations from the first on the second.
pub type Matrix = BTreeMap<String, BTreeMap<Place, BTreeMap<Place, Cross>>>;

/// The matrix of one goodness of fit over all variants; of the replicates, the best one counts.
pub fn matrix(inventory: &Inventory, gof: &str) -> Matrix {
    let mut matrix = Matrix::new();
    for part in inventory.winners().into_iter().filter(|part| part.calibration.gof == gof) {
        let row = &part.calibration;
        let from = (row.platoon.clone(), row.follower);
        let own = matrix.entry(row.vehicle.clone()).or_default().entry(from.clone()).or_default();
        if let Some(run) = &row.run {
            own.entry(from).or_default().add(run);
        }
        for validation in &part.validations {
            own.entry((validation.platoon.clone(), validation.follower)).or_default().add(&validation.run);
        }
    }
    matrix
}
