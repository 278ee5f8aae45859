//! The oracle: a plain scalar f64 transcription of the paper, for reading side by side.
//!
//! It mirrors `shaders/` file by file and shares no code with them; every other evaluator is compared with it.

mod constraint;
mod controller;
mod dynamics;
mod evaluate;
mod extension;
#[doc(hidden)]
pub mod law;
mod lookup;
#[doc(hidden)]
pub mod parts;
mod simulate;
mod spacing;
mod types;

pub use evaluate::Reference;
pub use extension::knows;
pub use simulate::{Run, Trace, disturbed, simulate};
pub use types::Perceived;
