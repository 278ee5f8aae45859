//! Input of the simulations: a drive, synthetic or measured, and random candidates.

use super::BenchError;
use crate::calibrate::{Overrides, SearchSpace};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::{Case, Population};
use crate::optimize::stream;
use crate::synthetic;
use crate::trajectory::{Grade, Preparation, Recording, Trajectory, import, prepare};
use crate::vehicle::{Mfc, Vehicle};
use rand::RngExt;

/// Number of samples of the synthetic drive: that of platoon 7 of the AstaZero data, used for earlier measurements.
const SAMPLES: u32 = 9227;

/// Upper bound of the perception delay \[s\]: Table 3.
const TAU_P_UPPER: f64 = 0.8;

/// One follower's drive with all signals that any variant may need.
#[derive(Debug, Clone)]
pub struct Drive {
    /// In words, for the report.
    pub name: String,
    trajectory: Trajectory,
    vehicle: Vehicle,
}

impl Drive {
    /// A synthetic drive behind a car on cruise control, 9,227 samples at 10 Hz; the same on every machine.
    pub fn synthetic() -> Result<Drive, BenchError> {
        let mut scenario =
            synthetic::Scenario { duration_s: f64::from(SAMPLES - 1) / 10.0, ..synthetic::Scenario::default() };
        scenario.followers.truncate(1);
        let platoon = synthetic::run(&scenario)?;
        let mut file = Vec::new();
        synthetic::write_pair(&platoon, 1, &mut file).expect("a Vec takes all, and there is a follower 1");
        Drive::new("synthetic drive", &import::read_bytes(&file, "synthetic.csv", None)?, 1)
    }

    /// The longest piece of one follower of a recording. Variants that need a vehicle or a grade get a synthetic vehicle and, if the recording has
    /// none, a level road: they cost the same time. Fails for an unknown follower.
    pub fn new(name: &str, recording: &Recording, follower: usize) -> Result<Drive, BenchError> {
        let mut trajectory = Trajectory::longest(prepare(recording, follower, &Preparation::default())?);
        trajectory.grade = Some(trajectory.grade.as_ref().map_or_else(Grade::level, evenly));
        let vehicle = Vehicle {
            mfc: Some(Mfc {
                v: vec![0.0, 10.0, 20.0, 30.0, 40.0, 50.0],
                a_ap: vec![4.0, 3.6, 3.0, 2.4, 1.7, 1.0],
                a_dp: vec![-6.0, -6.5, -7.0, -7.4, -7.7, -8.0],
                source: None,
            }),
            ..Vehicle::built_in().swap_remove(0)
        };
        Ok(Drive { name: format!("{name}, follower {follower}"), trajectory, vehicle })
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.trajectory.len()
    }

    /// The drive for a variant, in the paper's convention. Fails if the drive is too short for it.
    pub fn case(&self, variant: Variant) -> Result<Case, BenchError> {
        Ok(Case::new(&self.trajectory, variant, Some(&self.vehicle), Convention::PAPER, TAU_P_UPPER)?)
    }

    /// The first samples only.
    pub fn cut(&self, samples: usize) -> Drive {
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

    /// The box that a calibration of a variant searches.
    pub fn space(&self, variant: Variant) -> Result<SearchSpace, BenchError> {
        Ok(SearchSpace::new(&variant, Some(&self.vehicle), Convention::PAPER, &Overrides::new())?)
    }
}

/// A grade with nodes 10 m apart. One node per sample, as pair files have it, is denser than the tables of `lanes` and `gpu` may be
/// wherever the car is slow.
fn evenly(grade: &Grade) -> Grade {
    let (first, last) = (grade.x.first().copied().unwrap_or(0.0), grade.x.last().copied().unwrap_or(0.0));
    let x: Vec<f64> = (0..=((last - first) / 10.0) as u32).map(|k| first + 10.0 * f64::from(k)).collect();
    Grade { sin: x.iter().map(|x| grade.at(*x)).collect(), x, period: grade.period, source: grade.source.clone() }
}

/// Candidates drawn uniformly from a box; the same for the same box.
pub fn candidates(space: &SearchSpace, count: usize) -> Population {
    let mut population = Population::new(&space.symbols);
    for number in 0..count {
        let mut random = stream(1, 0, 0, number as u64);
        let draw = |[lower, upper]: &[f64; 2]| lower + (upper - lower) * random.random::<f64>();
        population.push(&space.bounds.iter().map(draw).collect::<Vec<_>>());
    }
    population
}
