//! Replaces the devices if the library is built without the feature `gpu`: there is none.

use crate::evaluator::{AdapterChoice, Case, EvaluateError, Evaluator};
use crate::score::GoodnessOfFit;
use crate::wgsl::Precision;

/// None exists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Device {
    pub name: String,
    /// False for software.
    pub is_hardware: bool,
    /// True for one with separate memory.
    pub is_discrete: bool,
}

pub fn is_switched_off() -> bool {
    false
}

pub fn find(_: &AdapterChoice) -> Result<Device, EvaluateError> {
    Err(EvaluateError::NoGpuBuilt)
}

pub fn open(
    _: Vec<Case>,
    _: GoodnessOfFit,
    _: Precision,
    _: &AdapterChoice,
) -> Result<Box<dyn Evaluator>, EvaluateError> {
    Err(EvaluateError::NoGpuBuilt)
}
