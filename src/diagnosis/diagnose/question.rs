//! What a diagnosis is asked, how far it is, and why it cannot be made.

use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::diagnose::drive::Drive;
use crate::extension::Extension;

/// How much computing a diagnosis may spend, as written in results and on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::EnumString, strum::IntoStaticStr, strum::VariantNames)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum Effort {
    /// About 20 s of CPU per drive of 15 minutes.
    Quick,
    /// Twice that.
    #[default]
    Normal,
    /// No time limit.
    Thorough,
}

/// What is asked.
#[derive(Debug, Clone, Copy)]
pub struct Question<'a> {
    /// Drives that models are fitted to.
    pub train: &'a [Drive],
    /// Drives on which a cause has to hold too; may be none.
    pub holdout: &'a [Drive],
    /// The model that is blamed.
    pub base: Variant,
    /// Search effort.
    pub effort: Effort,
    /// Decides all random starts.
    pub seed: u64,
    /// Causes in the race: those of the library and the user's own.
    pub causes: &'a [&'static Extension],
    /// Bounds of parameters by name, instead of those of the diagnosis.
    pub bounds: &'a Overrides,
}

/// How far a diagnosis is.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// Share of the work that is done, 0 to 1; a guess, as nobody knows how many causes will be found.
    pub done: f64,
    /// What is being done, in words.
    pub stage: String,
}

/// A diagnosis that cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// No data.
    #[error("no drive to train on; give at least one file of some minutes")]
    NoData,
    /// A drive that the model cannot be run on.
    #[error(transparent)]
    Case(#[from] crate::evaluator::CaseError),
    /// A model that cannot be run.
    #[error(transparent)]
    Evaluate(#[from] crate::evaluator::EvaluateError),
    /// Two extensions that exclude each other.
    #[error(transparent)]
    Conflict(#[from] crate::extension::ExtensionConflict),
    /// Bounds that cannot be.
    #[error(transparent)]
    Bounds(#[from] crate::calibrate::BoundsError),
    /// No parameters were found with which the base model survives the data.
    #[error(
        "{variant}: every candidate fails on these drives, even corrected by the measurement at every sample; check that spacing \
         is bumper to bumper and positive, and that the bounds allow a car that keeps its distance"
    )]
    NoBase {
        /// The base.
        variant: String,
    },
    /// It was stopped.
    #[error("stopped")]
    Stopped,
}
