//! The oracle: a plain scalar f64 transcription of the paper, to be read beside it.
//!
//! It mirrors `shaders/` file by file, shares no code with them, and every other evaluator is compared with it.

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
