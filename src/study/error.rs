//! Studies that cannot be carried out.

use super::PlanError;
use crate::calibrate::{BoundsError, CalibrateError};
use crate::evaluator::{CaseError, EvaluateError};
use crate::trajectory::import::MapError;
use crate::trajectory::{ImportError, PrepareError};
use crate::vehicle::VehicleError;
use crate::workers::NoThread;
use std::path::Path;

/// A study that cannot be planned, run or merged.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// Every trajectory of a vehicle is validated on every other one, and these are too many.
    #[error(
        "the plan has {runs} validation runs, expected at most {most}: each winner is validated on all other platoons of its vehicle, {drives} \
         trajectories in all; set validation.on = \"none\", or name different vehicles by `vehicle` in [[platoon]]"
    )]
    TooManyValidations {
        /// Runs.
        runs: u64,
        /// Runs that may be.
        most: u64,
        /// Trajectories.
        drives: usize,
    },
    /// The plan cannot be carried out.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The data cannot be used.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// A variant cannot be calibrated on a trajectory.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A variant needs missing data of a trajectory.
    #[error("{drive}: variant {variant} needs {what}; {remedy}")]
    Missing {
        /// The trajectory.
        drive: String,
        /// The variant.
        variant: String,
        /// The required data.
        what: &'static str,
        /// The remedy.
        remedy: &'static str,
    },
    /// Invalid bounds of a variant.
    #[error("variant {variant}")]
    Bounds {
        /// The variant.
        variant: String,
        /// The cause of the error.
        source: BoundsError,
    },
    /// The evaluator failed.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// A calibration failed without a result.
    #[error("task {id}")]
    Calibrate {
        /// The task.
        id: String,
        /// The cause of the error.
        source: CalibrateError,
    },
    /// A file or folder of the study.
    #[error("{path}: cannot {doing}")]
    File {
        /// The file.
        path: String,
        /// The step under way.
        doing: &'static str,
        /// The cause of the error.
        source: std::io::Error,
    },
    /// Not a study folder.
    #[error("{0}: expected a study folder; make one with `leadlag study plan PLAN.toml --out {0}`")]
    NoStudy(String),
    /// A plan where a study folder is expected.
    #[error(
        "{0}: expected a study folder, found a file; make one with `leadlag study plan {0} --out DIR`, then name DIR"
    )]
    PlanForFolder(String),
    /// A file of the folder with unexpected content.
    #[error(
        "{path}:{line}: expected {expected}; write it again with `leadlag study plan PLAN.toml --out DIR`, which keeps finished parts"
    )]
    Content {
        /// The file.
        path: String,
        /// Its line, from 1.
        line: usize,
        /// The expected value.
        expected: &'static str,
    },
    /// A plan that is not the copy of a study exists at the path of the copy.
    #[error(
        "{0}: the folder holds another plan, which the study's copy of this one would replace; give another folder with --out, or rename that plan"
    )]
    ForeignPlan(String),
    /// The tasks belong to another plan than the rest.
    #[error(
        "{0}: tasks.jsonl is not the list that study.json was written for: planning was interrupted, or one of them was \
         changed; repeat `leadlag study plan PLAN.toml --out {0}`: finished parts are kept"
    )]
    HalfPlanned(String),
    /// The folder's plan has changed since it was planned.
    #[error(
        "{folder}: {changed} of {tasks} tasks are not those that were planned: the data, the plan or the program ({program}) have \
         changed since; `leadlag study plan {folder}/plan.toml --data {data} --out {folder}` accepts that, and keeps the parts of all unchanged tasks"
    )]
    Changed {
        /// The folder.
        folder: String,
        /// The data folder.
        data: String,
        /// Tasks that differ.
        changed: usize,
        /// All tasks.
        tasks: usize,
        /// This program.
        program: String,
    },
    /// No thread can be started.
    #[error(transparent)]
    Threads(#[from] NoThread),
    /// No such task.
    #[error("task `{id}`: {found} tasks of this study begin with this id, expected one{}; tasks.jsonl lists all", listed(first, *found))]
    NoTask {
        /// As given.
        id: String,
        /// Number of tasks whose ids begin with it.
        found: usize,
        /// The ids of the first of them.
        first: Vec<String>,
    },
}

/// Data of a plan that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// The file cannot be imported.
    #[error("{}", unread(platoon, missing.as_deref()))]
    Import {
        /// The platoon.
        platoon: String,
        /// The file, if it is missing.
        missing: Option<String>,
        /// The cause of the error.
        source: Box<ImportError>,
    },
    /// The column map is broken or unknown.
    #[error("platoon {platoon}: columns")]
    Map {
        /// The platoon.
        platoon: String,
        /// The cause of the error.
        source: Box<MapError>,
    },
    /// The follower cannot be prepared.
    #[error("platoon {platoon}")]
    Prepare {
        /// The platoon.
        platoon: String,
        /// The cause of the error.
        source: Box<PrepareError>,
    },
    /// Several trajectories, of which a study needs one.
    #[error(
        "platoon {platoon} follower {follower}: {count} trajectories ({}); take all with trajectories = \"all\", choose one with trajectory = \"ID\", or cut one out with from_s and to_s if long gaps split the file",
        labels.join(", ")
    )]
    Several {
        /// The platoon.
        platoon: String,
        /// The follower.
        follower: usize,
        /// Their number.
        count: usize,
        /// The first of them.
        labels: Vec<String>,
    },
    /// No file matches a pattern.
    #[error("platoon {platoon}: expected files {pattern}, found none")]
    NoFile {
        /// The platoon.
        platoon: String,
        /// The pattern.
        pattern: String,
    },
    /// None of the trajectories of an entry can be used.
    #[error("platoon {platoon}: none of {count} trajectories can be used; the first: {reason}")]
    NoneUsable {
        /// The platoon.
        platoon: String,
        /// Their number.
        count: usize,
        /// The fault of the first.
        reason: String,
    },
    /// The vehicle is unknown, or its table is broken.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
}

fn unread(platoon: &str, missing: Option<&str>) -> String {
    match missing {
        Some(path) => format!(
            "{path}: no such file, needed by platoon {platoon}; `--data DIR` names another data folder than the plan does"
        ),
        None => format!("platoon {platoon}"),
    }
}

/// `: A, B, ...` of the known ids.
fn listed(first: &[String], found: usize) -> String {
    let more = if found > first.len() { ", ..." } else { "" };
    if first.is_empty() { String::new() } else { format!(": {}{more}", first.join(", ")) }
}

impl StudyError {
    /// An error with a file or folder.
    pub fn file(path: &Path, doing: &'static str) -> impl FnOnce(std::io::Error) -> StudyError {
        let path = path.display().to_string();
        move |source| StudyError::File { path, doing, source }
    }
}
