//! Studies that cannot be carried out.

use super::PlanError;
use crate::batch::NoThread;
use crate::calibrate::{BoundsError, CalibrateError};
use crate::evaluator::{CaseError, EvaluateError};
use crate::text::option::OUT;
use crate::trajectory::import::MapError;
use crate::trajectory::{ImportError, PrepareError};
use crate::vehicle::VehicleError;
use std::path::Path;

/// A study that cannot be planned, run or merged.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    #[error(
        "the plan has {runs} validation runs, expected at most {most}: each winner is validated on all other platoons of its vehicle, {drives} \
         trajectories in all; set validation.on = \"none\", or name different vehicles by `vehicle` in [[platoon]]"
    )]
    TooManyValidations { runs: u64, most: u64, drives: usize },
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(transparent)]
    Drive(#[from] DriveError),
    #[error(transparent)]
    Case(#[from] CaseError),
    #[error("{drive}: variant {variant} needs {what}; {remedy}")]
    Missing { drive: String, variant: String, what: &'static str, remedy: &'static str },
    #[error("variant {variant}")]
    Bounds { variant: String, source: BoundsError },
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    #[error("task {id}")]
    Calibrate { id: String, source: CalibrateError },
    #[error("{path}: cannot {doing}")]
    File { path: String, doing: &'static str, source: std::io::Error },
    #[error("{0}: expected a study folder; make one with `leadlag study plan PLAN.toml --out {0}`")]
    NoStudy(String),
    #[error(
        "{0}: expected a study folder, found a file; make one with `leadlag study plan {0} --out DIR`, then name DIR"
    )]
    PlanForFolder(String),
    #[error(
        "{path}:{line}: expected {expected}; write it again with `leadlag study plan PLAN.toml --out DIR`, which keeps finished parts"
    )]
    Content { path: String, line: usize, expected: &'static str },
    #[error(
        "{0}: the folder holds another plan, which the study's copy of this one would replace; give another folder with {OUT}, or rename that plan"
    )]
    ForeignPlan(String),
    #[error(
        "{0}: tasks.jsonl is not the list that study.json was written for: planning was interrupted, or one of them was \
         changed; repeat `leadlag study plan PLAN.toml --out {0}`: finished parts are kept"
    )]
    HalfPlanned(String),
    #[error(
        "{folder}: {changed} of {tasks} tasks are not those that were planned: the data, the plan or the program ({program}) have \
         changed since; `leadlag study plan {folder}/plan.toml --data {data} --out {folder}` accepts that, and keeps the parts of all unchanged tasks"
    )]
    Changed { folder: String, data: String, changed: usize, tasks: usize, program: String },
    #[error(transparent)]
    Threads(#[from] NoThread),
    #[error("task `{id}`: {found} tasks of this study begin with this id, expected one{}; tasks.jsonl lists all", listed(first, *found))]
    NoTask { id: String, found: usize, first: Vec<String> },
}

/// Data of a plan that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    #[error("{}", unread(platoon, missing.as_deref()))]
    Import { platoon: String, missing: Option<String>, source: Box<ImportError> },
    #[error("platoon {platoon}: columns")]
    Map { platoon: String, source: Box<MapError> },
    #[error("platoon {platoon}")]
    Prepare { platoon: String, source: Box<PrepareError> },
    #[error(
        "platoon {platoon} follower {follower}: {count} trajectories ({}); take all with trajectories = \"all\", choose one with trajectory = \"ID\", or cut one out with from_s and to_s if long gaps split the file",
        labels.join(", ")
    )]
    Several { platoon: String, follower: usize, count: usize, labels: Vec<String> },
    #[error("platoon {platoon}: expected files {pattern}, found none")]
    NoFile { platoon: String, pattern: String },
    #[error("platoon {platoon}: none of {count} trajectories can be used; the first: {reason}")]
    NoneUsable { platoon: String, count: usize, reason: String },
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
