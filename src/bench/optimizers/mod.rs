//! Quality of the optimisers: targets on one follower with many seeds, the spread of replicates over all variants and followers
//! of the three processed platoons, and the time of one calibration from start to end.
//!
//! Each finished task is one line of a journal, so that a stopped run can continue. A task depends only on its settings; a line is reused
//! only if they are the same.

mod report;
mod wall;

pub use report::{Finding, OptimizerReport};

use super::BenchError;
use super::{Progress, do_remaining};
use crate::batch::{Entry, Journal, JournalError};
use crate::calibrate::{
    CalibrateError, Calibration, OptimizerKind, Overrides, PROGRAM, Replicate, SearchSpace, Stop, StopReason, calibrate,
};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::Case;
use crate::lanes::{Lanes, LanesPrecision};
use crate::score::GoodnessOfFit;
use crate::trajectory::{Preparation, Trajectory, import, prepare};
use crate::vehicle::{self, Vehicle};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A calibration to be run: one variant, one follower, one seed.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct OptimizerTask {
    /// Purpose: `seeds`, `wall`, `spread` or `hard`.
    pub aim: String,
    /// `auto`, `ga`, `lshade` or `cmaes`.
    pub optimizer: String,
    /// `authors` or `paper`.
    pub convention: String,
    /// Id of the variant.
    pub model_id: u32,
    /// Platoon of the drive, from 3 to 5.
    pub platoon: u32,
    /// Follower, from 1.
    pub follower: usize,
    pub seed: u64,
    pub replicates: u64,
    /// Largest number of evaluations of a replicate.
    pub max_evaluations: u64,
}

/// Results, one entry per replicate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OptimizerOutcome {
    /// Version of the program and state of its search.
    pub program: String,
    pub task: OptimizerTask,
    /// Scores of the best candidates by the f64 reference; none if it fails there.
    pub scores: Vec<Option<f64>>,
    /// Evaluations spent.
    pub evaluations: Vec<u64>,
    /// Why each ended, in words.
    pub stops: Vec<String>,
    /// Wall time of all replicates together; of a `wall` task, of the program from its start to its end \[s\].
    pub wall_s: f64,
}

impl Entry for OptimizerOutcome {
    type Key = OptimizerTask;

    fn key(&self) -> &OptimizerTask {
        &self.task
    }
}

impl OptimizerOutcome {
    /// The journal of finished tasks in a file, without those of another program or state of the search.
    pub fn journal(path: &Path) -> Result<Journal<Self>, JournalError> {
        let is_own = |outcome: &Self| outcome.program == *PROGRAM;
        Journal::open(path, None, &|line| Ok(serde_json::from_slice(line).ok().filter(is_own)))
    }
}

/// A value to be reached within this many evaluations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeedTarget {
    /// Variant; the follower is the first one of platoon 3.
    pub model_id: u32,
    /// NRMSE(s,v,a) to be reached.
    pub score: f64,
    pub evaluations: u64,
    /// This many of ten seeds.
    pub of_ten: usize,
}

/// The targets of the project. The algorithm of the paper's authors ends at 0.378903 and 0.284795 after 700,100 evaluations.
pub const SEED_TARGETS: [SeedTarget; 2] = [
    SeedTarget { model_id: 1, score: 0.37895, evaluations: 24_000, of_ten: 10 },
    SeedTarget { model_id: 28, score: 0.2836, evaluations: 60_000, of_ten: 9 },
];

/// Seeds that settings were chosen on, and seeds held out.
pub const SEEDS: [std::ops::RangeInclusive<u64>; 2] = [1..=10, 101..=110];

/// Files of the platoons, by their number in the paper.
const PLATOONS: [(u32, &str); 3] =
    [(3, "ASta_040719_platoon7"), (4, "ASta_040719_platoon8"), (5, "ASta_040719_platoon9")];

/// Variant, platoon and follower of surfaces with several basins: all pairs of which replicates with 24,000 evaluations differed by more
/// than 1 % in either study of the twelve processed trajectories (convention `paper`; the first had a smaller population), and one more
/// that did so with 100,000.
const HARD: [(u32, u32, usize); 36] = [
    (25, 4, 2),
    (26, 4, 2),
    (27, 4, 2),
    (28, 3, 1),
    (31, 3, 1),
    (32, 3, 1),
    (61, 4, 1),
    (61, 5, 2),
    (62, 4, 1),
    (62, 5, 2),
    (63, 4, 1),
    (63, 5, 2),
    (64, 3, 2),
    (70, 4, 1),
    (71, 4, 1),
    (72, 4, 1),
    (73, 3, 2),
    (73, 5, 1),
    (75, 5, 1),
    (79, 4, 2),
    (79, 5, 1),
    (80, 5, 1),
    (80, 5, 2),
    (81, 4, 2),
    (81, 5, 1),
    (82, 5, 1),
    (83, 4, 1),
    (83, 5, 1),
    (84, 4, 1),
    (85, 5, 1),
    (87, 5, 1),
    (88, 4, 1),
    (89, 4, 1),
    (89, 5, 1),
    (90, 4, 1),
    (90, 5, 1),
];

/// Wall time that one calibration may take, from the start of the program to `result.json` \[s\].
const WALL_TARGET_S: f64 = 3.0;

/// Surfaces over which the spread is to be small: every variant on every follower.
const SURFACES: usize = Variant::COUNT as usize * 12;

/// Step from one surface to the next in the order of the spread. It has no common factor with their number and is close to its golden
/// section, so that the first few spread evenly over variants and followers. So a run that was stopped early is a fair sample.
const STEP: usize = 667;

/// Replicates whose spread is measured.
const REPLICATES: u64 = 10;

/// The tasks for an optimiser: seeds first, then one calibration by the program itself (of `auto`, for which there is a target), the hard
/// surfaces, and the spread over everything; `quick` takes five seeds of each ten, no hard ones, and twelve variants, one per follower.
pub fn optimizer_tasks(optimizer: &str, quick: bool) -> Vec<OptimizerTask> {
    let mut tasks = Vec::new();
    let task = |aim: &str, model_id, platoon, follower, seed, replicates, max_evaluations| OptimizerTask {
        aim: aim.to_owned(),
        optimizer: optimizer.to_owned(),
        convention: if matches!(aim, "hard" | "wall") { "paper" } else { "authors" }.to_owned(),
        model_id,
        platoon,
        follower,
        seed,
        replicates,
        max_evaluations,
    };
    for target in SEED_TARGETS {
        for seed in SEEDS.into_iter().flat_map(|seeds| seeds.take(if quick { 5 } else { 10 })) {
            tasks.push(task("seeds", target.model_id, 3, 1, seed, 1, target.evaluations));
        }
    }
    let default = Stop::default().max_evaluations;
    if optimizer == OptimizerKind::Auto.into_str() {
        tasks.push(task("wall", 28, 3, 1, 1, 1, default));
    }
    for (id, platoon, follower) in HARD.into_iter().filter(|_| !quick) {
        tasks.push(task("hard", id, platoon, follower, 1, REPLICATES, default));
    }
    for surface in (0..SURFACES).map(|i| i * STEP % SURFACES) {
        let (k, id) = (surface / Variant::COUNT as usize, 1 + surface as u32 % Variant::COUNT);
        // 7 and 90 have no common factor: twelve variants spread over bases and extensions.
        if !quick || id == 1 + (7 * k as u32 + 3) % Variant::COUNT {
            tasks.push(task("spread", id, 3 + k as u32 / 4, 1 + k % 4, 1, REPLICATES, default));
        }
    }
    tasks
}

/// Runs the tasks that the journal lacks, and adds each to it. `program` is the executable that `wall` tasks start. `progress` receives the
/// number of finished tasks, before every task and, except for `wall`, during it, and can stop the run: the present task is then not kept.
pub fn run_optimizers(
    shared: &Path,
    program: &Path,
    tasks: &[OptimizerTask],
    journal: &mut Journal<OptimizerOutcome>,
    progress: &mut Progress<'_, OptimizerTask>,
) -> Result<(), BenchError> {
    let data = Followers::new(shared)?;
    do_remaining(tasks, journal, progress, |task, progress| match task.aim.as_str() {
        "wall" => wall::run(program, &data.file(task.platoon), task).map(Some),
        _ => run(&data, task, progress),
    })
}

/// `None` if it was stopped.
fn run(
    data: &Followers,
    task: &OptimizerTask,
    progress: &mut (dyn FnMut() -> ControlFlow<()> + Send),
) -> Result<Option<OptimizerOutcome>, BenchError> {
    let variant = Variant::from_id(task.model_id)?;
    let (trajectory, vehicle) = data.get(task.platoon, task.follower)?;
    let convention: Convention = task.convention.parse()?;
    let space = SearchSpace::new(&variant, vehicle, convention, &Overrides::new())?;
    let case = Case::new(&trajectory, variant, vehicle, convention, space.tau_p_upper())?;
    let settings = Calibration {
        optimizer: task.optimizer.parse::<OptimizerKind>()?,
        seed: task.seed,
        replicates: task.replicates,
        stop: Stop { max_evaluations: task.max_evaluations, ..Stop::default() },
        population: None,
    };
    let started = Instant::now();
    let mut lanes = Lanes::new(vec![case], GoodnessOfFit::NRMSE_SVA, LanesPrecision::Plain)?;
    let (mut stopped, mut spent) = (false, vec![0; task.replicates as usize]);
    let found = calibrate(&mut lanes, &space, &settings, &mut |told| {
        spent[told.replicate as usize] = told.evaluations;
        let told = progress();
        stopped |= told.is_break();
        told
    });
    let wall_s = started.elapsed().as_secs_f64();
    if stopped { Ok(None) } else { outcome(task, found, spent, wall_s).map(Some) }
}

/// Result of a calibration. If no candidate of any replicate is feasible, that is the result for the surface.
fn outcome(
    task: &OptimizerTask,
    found: Result<Vec<Replicate>, CalibrateError>,
    spent: Vec<u64>,
    wall_s: f64,
) -> Result<OptimizerOutcome, BenchError> {
    let (scores, evaluations, stops) = match found {
        Err(CalibrateError::Infeasible { .. }) => {
            let stops = vec![StopReason::Infeasible.to_string(); spent.len()];
            (vec![None; spent.len()], spent, stops)
        }
        found => {
            let found = found?;
            (
                found.iter().map(|r| Some(r.score).filter(|score| score.is_finite())).collect(),
                found.iter().map(|r| r.evaluations).collect(),
                found.iter().map(|r| r.stop.to_string()).collect(),
            )
        }
    };
    Ok(OptimizerOutcome { program: PROGRAM.clone(), task: task.clone(), scores, evaluations, stops, wall_s })
}

/// The folder of the measured platoons, and their cars.
struct Followers {
    folder: PathBuf,
    vehicles: Vec<Vehicle>,
}

impl Followers {
    fn new(shared: &Path) -> Result<Followers, BenchError> {
        let vehicles = vehicle::read_table(&shared.join("data/vehicles/vehicles.csv"))?;
        Ok(Followers { folder: shared.join("data/astazero_c2art"), vehicles })
    }

    fn file(&self, platoon: u32) -> PathBuf {
        let stem = PLATOONS.iter().find(|(number, _)| *number == platoon).map_or("unknown", |(_, stem)| stem);
        self.folder.join(format!("{stem}.csv"))
    }

    fn get(&self, platoon: u32, follower: usize) -> Result<(Trajectory, Option<&Vehicle>), BenchError> {
        let recording = import::read(&self.file(platoon), None)?;
        let trajectory = Trajectory::longest(prepare(&recording, follower, &Preparation::default())?);
        let vehicle = self.vehicles.iter().find(|vehicle| vehicle.is_called(&trajectory.name));
        Ok((trajectory, vehicle))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Tally;

    #[test]
    fn a_surface_without_a_feasible_candidate_is_a_result() {
        let task = optimizer_tasks("auto", true).pop().expect("tasks");
        let nothing = Err(CalibrateError::Infeasible { replicate: 0, evaluations: 900, tally: Tally::default() });
        let spent: Vec<u64> = (900..910).collect();
        let outcome = outcome(&task, nothing, spent.clone(), 1.0).expect("no error");
        assert_eq!((outcome.scores.as_slice(), &outcome.evaluations), ([None; 10].as_slice(), &spent));
        assert_eq!(outcome.stops, vec!["no feasible candidate found"; 10]);
        assert_eq!(outcome.variation(), f64::INFINITY);
    }
}
