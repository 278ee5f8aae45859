//! The composed WGSL text on the CPU: naga's form of it becomes a straight-line program over blocks of candidates.
//!
//! `compile` turns a text into instructions over rows, `run` runs them over a population. Every operation is rounded separately and none is
//! reordered, so that every instruction set gives the same bits.
#![allow(clippy::needless_range_loop, reason = "one index for the same lane of several rows")]
#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "the kernel defines the treatment of NaN")]

mod compile;
mod evaluator;
mod function;
mod run;

pub use compile::error::LanesError;
pub use compile::model::check_model;
pub use evaluator::{Lanes, LanesPrecision};
pub use function::Function;
pub use run::exponential::{exponential, exponential_f64, logarithm, logarithm_f64};
pub use run::power::power;
pub use run::power_f64::power as power_f64;
pub use run::products::Bins;
pub use run::simd::InstructionSet;
