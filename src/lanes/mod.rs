//! The composed WGSL text on the CPU: naga's form of it becomes a straight-line program over blocks of candidates.
//!
//! `flatten` turns a function into scalar operations, `schedule` these into instructions (`fuse` and `group` tell which do
//! several operations at once), `simd` runs them over rows of lanes, `run` is the time loop of shaders/kernel.wgsl around it.
//! Every operation is rounded by itself and none changes places with another, so that every instruction set gives the same bits.
#![allow(clippy::needless_range_loop, reason = "one index for the same lane of several rows")]
#![allow(
    clippy::neg_cmp_op_on_partial_ord,
    reason = "where a NaN goes is the kernel's business, not a matter of taste"
)]

mod binary;
mod code;
mod core;
mod error;
mod evaluator;
mod exponential;
mod flat;
mod flatten;
mod function;
mod fuse;
mod group;
mod model;
mod operation;
mod plan;
mod power;
mod power_f64;
mod real;
mod rows;
mod run;
mod schedule;
mod simd;
mod stream;
mod sums;
mod tables;

pub use error::LanesError;
pub use evaluator::{Lanes, LanesPrecision};
pub use exponential::{exponential, exponential_f64, logarithm, logarithm_f64};
pub use function::Function;
pub use model::check_model;
pub use power::power;
pub use power_f64::power as power_f64;
pub use simd::InstructionSet;
