//! The measured followers of the shared data with their vehicles and road, and candidates for them.

use leadlag::internal::calibrate::{Overrides, SearchSpace};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Case, Population};
use leadlag::internal::trajectory::{Preparation, Trajectory, import, prepare};
use leadlag::internal::vehicle::{Vehicle, read_table};
use std::path::Path;

use super::cars::within;

/// One follower of a platoon.
#[derive(Clone)]
pub struct Follower {
    pub trajectory: Trajectory,
    pub vehicle: Vehicle,
}

/// All twelve: three platoons, four followers each.
pub fn all(shared: &Path) -> Vec<Follower> {
    let vehicles = read_table(&shared.join("data/vehicles/vehicles.csv")).expect("vehicles.csv");
    let mut followers = Vec::new();
    for platoon in ["ASta_040719_platoon7", "ASta_040719_platoon8", "ASta_040719_platoon9"] {
        let file = shared.join(format!("data/astazero_c2art/{platoon}.csv"));
        let recording = import::read(&file, None).expect("a processed platoon");
        for number in 1..=4 {
            let trajectory = prepare(&recording, number, &Preparation::default()).expect("a follower").remove(0);
            assert!(trajectory.grade.is_some(), "{}: the grade lies beside the file", trajectory.label);
            let vehicle = vehicles.iter().find(|v| v.is_called(&trajectory.name)).cloned();
            let vehicle = vehicle.unwrap_or_else(|| panic!("no vehicle is called {}", trajectory.name));
            followers.push(Follower { trajectory, vehicle });
        }
    }
    followers
}

impl Follower {
    /// The first samples only.
    #[must_use]
    pub fn cut(&self, samples: usize) -> Follower {
        let mut cut = self.clone();
        let t = &mut cut.trajectory;
        for signal in [&mut t.t, &mut t.x_l, &mut t.v_l, &mut t.x_f, &mut t.v_f, &mut t.s] {
            signal.truncate(samples);
        }
        for signal in [&mut t.v_l2, &mut t.s_l2].into_iter().flatten() {
            signal.truncate(samples);
        }
        cut
    }

    #[must_use]
    pub fn case(&self, variant: Variant, convention: Convention) -> Case {
        Case::new(&self.trajectory, variant, Some(&self.vehicle), convention, 0.8).expect("all that a variant needs")
    }

    /// The bounds of Table 3 for this follower.
    #[must_use]
    pub fn space(&self, variant: Variant, convention: Convention) -> SearchSpace {
        SearchSpace::new(&variant, Some(&self.vehicle), convention, &Overrides::new()).expect("Table 3")
    }

    /// Random candidates within Table 3, this share of the values on a bound.
    #[must_use]
    pub fn population(
        &self,
        variant: Variant,
        convention: Convention,
        count: usize,
        seed: u64,
        at_bounds: f64,
    ) -> Population {
        within(&self.space(variant, convention), count, seed, at_bounds)
    }
}
