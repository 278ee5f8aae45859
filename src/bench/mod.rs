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
mod journal;
mod machine;
mod measure;
mod optimizers;
mod plan;
mod text;

pub use contender::Contender;
pub use data::{Drive, candidates};
pub use diagnosis::{Bar, DiagnosisOutcome, DiagnosisReport, DiagnosisTask, Judgement, Planted};
pub use diagnosis::{
    Gains, LARGEST_SEED, MOST_OF_IT, Power, PowerAt, SIZES, Silence, diagnose_task, diagnosis_tasks, infer_task, judge,
    planted, run_diagnoses,
};
pub use export::export;
pub use generation::Generation;
pub use goals::Goal;
pub use journal::{Journal, Outcome};
pub use machine::Machine;
pub use measure::Row;
pub use optimizers::{Finding, OptimizerOutcome, OptimizerReport, OptimizerTask};
pub use optimizers::{SEED_TARGETS, SEEDS, SeedTarget, optimizer_tasks, run_optimizers};
pub use plan::{Effort, Report, run};
pub use text::table;

use crate::calibrate::{BoundsError, CalibrateError};
use crate::catalog::UnknownVariant;
use crate::convention::ConventionError;
use crate::evaluator::{CaseError, EvaluateError};
use crate::synthetic::SyntheticError;
use crate::text::spelling::UnknownWord;
use crate::trajectory::{ImportError, PrepareError};
use crate::vehicle::VehicleError;

/// A measurement that failed.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The synthetic drive could not be made.
    #[error(transparent)]
    Synthetic(#[from] SyntheticError),
    /// The measured file could not be read.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// The file has no such follower, or no usable data.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// A variant cannot run on the drive.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The candidates cannot be drawn.
    #[error(transparent)]
    Bounds(#[from] BoundsError),
    /// The vehicles cannot be read.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// No such optimiser.
    #[error(transparent)]
    Optimizer(#[from] UnknownWord),
    /// No such convention.
    #[error(transparent)]
    Convention(#[from] ConventionError),
    /// No such variant.
    #[error(transparent)]
    Variant(#[from] UnknownVariant),
    /// An evaluator failed.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// The measured calibration failed.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// A seed whose cases would share seeds with another one.
    #[error("expected a seed from 0 to {most}, found {found}")]
    Seed {
        /// The largest.
        most: u64,
        /// The request.
        found: u64,
    },
    /// More cases than a seed has.
    #[error(
        "{sizes} sizes make {found} cases, and a seed has at most {most}: give fewer sizes, or run them in two parts with two seeds"
    )]
    Cases {
        /// Largest number.
        most: usize,
        /// Number found.
        found: usize,
        /// The requested sizes.
        sizes: usize,
    },
    /// The timed program fails.
    #[error("{program} calibrate: expected success, found: {said}")]
    Program {
        /// The program.
        program: String,
        /// Its output.
        said: String,
    },
    /// Files cannot be written.
    #[error("{path}: cannot write: {source}")]
    Write {
        /// The file.
        path: String,
        /// The cause of the error.
        source: std::io::Error,
    },
}
