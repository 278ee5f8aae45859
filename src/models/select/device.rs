//! Devices for the evaluator `gpu`.

use crate::evaluator::{AdapterChoice, Case, EvaluateError, Evaluator};
use crate::gpu::{Adapter, Gpu};
use crate::score::GoodnessOfFit;
use crate::wgsl::Precision;

pub use crate::gpu::is_switched_off;

/// Properties of a device that determine the evaluator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Device {
    /// Its name by the driver.
    pub name: String,
    /// False for software.
    pub is_hardware: bool,
    /// True for one with separate memory.
    pub is_discrete: bool,
}

pub fn find(choice: &AdapterChoice) -> Result<Device, EvaluateError> {
    let adapter = Adapter::choose(choice)?;
    let (is_hardware, is_discrete) = (adapter.is_hardware(), adapter.is_discrete());
    Ok(Device { name: adapter.info.name, is_hardware, is_discrete })
}

/// The evaluator on the device of a choice.
pub fn open(
    cases: Vec<Case>,
    gof: GoodnessOfFit,
    precision: Precision,
    choice: &AdapterChoice,
) -> Result<Box<dyn Evaluator>, EvaluateError> {
    Ok(Box::new(Gpu::new(cases, gof, precision, choice)?))
}
