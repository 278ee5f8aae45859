//! A synthetic drive with everything that a variant may need, and random candidates.

use leadlag::internal::calibrate::{Overrides, SearchSpace};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Case, Population};
use leadlag::internal::synthetic;
use leadlag::internal::trajectory::{Grade, Preparation, Trajectory, import, prepare};
use leadlag::internal::vehicle::{Mfc, Vehicle};
use std::path::Path;

/// Behind the leader of a made-up platoon on a hilly closed track.
pub fn drive(duration_s: f64) -> Trajectory {
    let platoon =
        synthetic::run(&synthetic::Scenario { duration_s, ..Default::default() }).expect("the scenario can be driven");
    let (mut file, mut slope) = (Vec::new(), Vec::new());
    synthetic::write_pair(&platoon, 1, &mut file).expect("memory");
    synthetic::write_slope(&platoon, &mut slope).expect("memory");
    let recording = import::read_bytes(&file, "pair.csv", None).expect("what was just written");
    let mut trajectory = prepare(&recording, 1, &Preparation::default()).expect("a good drive").remove(0);
    trajectory.grade = Some(Grade::read_from(slope.as_slice(), "slope.csv").expect("what was just written"));
    trajectory
}

/// A measured follower of the shared data.
pub fn measured(shared: &Path) -> Trajectory {
    let folder = shared.join("data/astazero_c2art");
    let recording = import::read(&folder.join("ASta_040719_platoon7.csv"), None).expect("a good file");
    let mut trajectory = prepare(&recording, 1, &Preparation::default()).expect("a good file").remove(0);
    trajectory.grade = Some(Grade::read_csv(&folder.join("Slope.csv")).expect("a good file"));
    trajectory
}

/// A car with MFC curves that bind.
pub fn vehicle() -> Vehicle {
    let mut vehicle = Vehicle::called("bmw_x5").expect("a built-in vehicle");
    let v: Vec<f64> = (0..25).map(|k| 2.0 * f64::from(k)).collect();
    let a_ap = v.iter().map(|v| 3.5 / (1.0 + 0.07 * v)).collect();
    let a_dp = v.iter().map(|v| -6.0 + 0.05 * v).collect();
    vehicle.mfc = Some(Mfc { v, a_ap, a_dp, source: None });
    vehicle
}

pub fn case(trajectory: &Trajectory, variant: Variant, convention: Convention) -> Case {
    Case::new(trajectory, variant, Some(&vehicle()), convention, 0.8).expect("the drive has all that a variant needs")
}

/// Numbers in 0..1 from a seed (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Random candidates within Table 3, a third of the values on a bound.
pub fn population(variant: Variant, convention: Convention, count: usize, seed: u64) -> Population {
    spread(variant, convention, count, seed, 1.0 / 3.0)
}

/// Random candidates within Table 3.
pub fn spread(variant: Variant, convention: Convention, count: usize, seed: u64, at_bounds: f64) -> Population {
    let space = SearchSpace::new(&variant, Some(&vehicle()), convention, &Overrides::new()).expect("Table 3");
    within(&space, count, seed, at_bounds)
}

/// Random candidates within a search space, this share of the values on a bound.
pub fn within(space: &SearchSpace, count: usize, seed: u64, at_bounds: f64) -> Population {
    let mut random = Random(seed);
    let mut population = Population::new(&space.symbols);
    for _ in 0..count {
        let value = |[lower, upper]: &[f64; 2]| match random.next() {
            edge if edge < 0.5 * at_bounds => *lower,
            edge if edge < at_bounds => *upper,
            _ => lower + (upper - lower) * random.next(),
        };
        population.push(&space.bounds.iter().map(value).collect::<Vec<_>>());
    }
    population
}
