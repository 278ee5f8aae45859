//! How fast candidates are simulated: evaluators, variants and population sizes, measured in turns.
//!
//! The unit is Mcs, a million candidate-steps: N candidates over T samples are N T candidate-steps, even if some candidates crash on the
//! way. The table also has a loop written by hand (`native`) and the plain scalar reference, so that a figure can be
//! judged without knowing the machine. Repetitions of all contenders are interleaved, so that a change of the machine's load affects all
//! alike; every single time is kept. A hardware GPU comes after them, alone.

mod contender;
mod data;
mod diagnosis;
mod export;
mod generation;
mod goals;
mod machine;
mod measure;
mod optimizers;
mod plan;
mod text;

pub use contender::Contender;
pub use data::{Drive, candidates};
pub use diagnosis::{
    DiagnosisOutcome, DiagnosisReport, DiagnosisTask, Judgement, LARGEST_SEED, Planted, SIZES, diagnose_task,
    diagnosis_tasks, infer_task, judge, planted,
};
pub use export::export;
pub use generation::Generation;
pub use goals::Goal;
pub use machine::Machine;
pub use measure::Row;
pub use optimizers::{Finding, OptimizerOutcome, OptimizerReport, OptimizerTask};
pub use optimizers::{SEED_TARGETS, SEEDS, SeedTarget, optimizer_tasks, run_optimizers};
pub use plan::{Effort, Report, run};
pub use text::table;

use crate::batch::{Entry, Journal, JournalError};
use crate::calibrate::{BoundsError, CalibrateError};
use crate::catalog::UnknownVariant;
use crate::convention::ConventionError;
use crate::evaluator::{CaseError, EvaluateError};
use crate::synthetic::SyntheticError;
use crate::text::spelling::UnknownWord;
use crate::trajectory::{ImportError, PrepareError};
use crate::vehicle::VehicleError;
use std::ops::ControlFlow;

/// A measurement that failed.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    #[error(transparent)]
    Synthetic(#[from] SyntheticError),
    #[error(transparent)]
    Import(#[from] ImportError),
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    Case(#[from] CaseError),
    #[error(transparent)]
    Bounds(#[from] BoundsError),
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    #[error(transparent)]
    Optimizer(#[from] UnknownWord),
    #[error(transparent)]
    Convention(#[from] ConventionError),
    #[error(transparent)]
    Variant(#[from] UnknownVariant),
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    #[error("expected a seed from 0 to {most}, found {found}")]
    Seed { most: u64, found: u64 },
    #[error(
        "{sizes} sizes make {found} cases, and a seed has at most {most}: give fewer sizes, or run them in two parts with two seeds"
    )]
    Cases { most: usize, found: usize, sizes: usize },
    #[error("{program} calibrate: expected success, found: {said}")]
    Program { program: String, said: String },
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error("{path}: cannot write: {source}")]
    Write { path: String, source: std::io::Error },
}

/// Receives the number of finished tasks and the present one, and can stop the run.
pub type Progress<'a, T> = dyn FnMut(usize, &T) -> ControlFlow<()> + Send + 'a;

/// Asked by a task that is under way; breaks to stop it.
type Asks<'a> = dyn FnMut() -> ControlFlow<()> + Send + 'a;

/// Does the tasks that a journal lacks, one after the other, and adds each to it. `work` returns `None` if `progress` stops it: the task is then not
/// kept. Returns the first error of `work`.
pub fn do_remaining<E: Entry>(
    tasks: &[E::Key],
    journal: &mut Journal<E>,
    progress: &mut Progress<'_, E::Key>,
    mut work: impl FnMut(&E::Key, &mut Asks<'_>) -> Result<Option<E>, BenchError>,
) -> Result<(), BenchError> {
    for (done, task) in tasks.iter().enumerate() {
        if journal.get(task).is_some() {
            continue;
        }
        if progress(done, task).is_break() {
            break;
        }
        let Some(outcome) = work(task, &mut || progress(done, task))? else { break };
        journal.keep(outcome)?;
    }
    Ok(())
}
