//! Diagnosis of a model: search for and decision about causes, the race, and result files.
//!
//! Part of leadlag. Its interface may change with any version; depend on `leadlag`.

pub mod describe;
pub mod diagnose;
pub mod drivers;
pub mod judge;
pub mod pooling;
pub mod race;
pub mod result;

use leadlag_data::{statistics, text, trajectory, vehicle};
#[cfg(test)]
use leadlag_models::synthetic;
use leadlag_models::{
    calibrate, catalog, convention, evaluator, extension, identify, lanes, optimize, reference, rescore, score,
    simulate, symbols, wgsl,
};
