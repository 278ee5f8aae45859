//! The request for a diagnosis, its progress, and its errors.

use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::diagnose::drive::Drive;
use crate::extension::Extension;

/// Computing effort of a diagnosis, as written in results and on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::EnumString, strum::IntoStaticStr, strum::VariantNames)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum Effort {
    /// About 12 s of CPU per drive of 15 minutes.
    Quick,
    /// Twice that.
    #[default]
    Normal,
    /// No time limit.
    Thorough,
}

/// The request.
#[derive(Debug, Clone, Copy)]
pub struct Question<'a> {
    /// Drives that models are fitted to.
    pub train: &'a [Drive],
    /// Held-back drives on which a cause also has to gain; may be empty.
    pub holdout: &'a [Drive],
    /// The base model.
    pub base: Variant,
    /// Search effort.
    pub effort: Effort,
    /// Seed of all random starts.
    pub seed: u64,
    /// Causes to try: those of the library and the user's own.
    pub causes: &'a [&'static Extension],
    /// Bounds of parameters by name; they replace those of the diagnosis.
    pub bounds: &'a Overrides,
}

/// Progress of a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// Share of the work that is done, 0 to 1; an estimate, because the number of causes to be found is unknown.
    pub done: f64,
    /// The present stage, in words.
    pub stage: String,
}

/// A diagnosis that failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum DiagnoseError {
    #[error("no drive to train on; give at least one file of some minutes")]
    NoData,
    #[error(transparent)]
    Case(#[from] crate::evaluator::CaseError),
    #[error(transparent)]
    Evaluate(#[from] crate::evaluator::EvaluateError),
    #[error(transparent)]
    Conflict(#[from] crate::extension::ExtensionConflict),
    #[error(transparent)]
    Bounds(#[from] crate::calibrate::BoundsError),
    #[error(
        "{variant}: every candidate fails on these drives, even corrected by the measurement at every sample; check that spacing \
         is bumper to bumper and positive, and that the bounds allow a car that keeps its distance"
    )]
    NoBase { variant: String },
    #[error("stopped")]
    Stopped,
}
