//! The definition of every model part: WGSL texts, composed per variant and checked by naga.
//!
//! `compose` concatenates one file per folder of `shaders/`; `check` parses and validates the result and reports the file with the problem.
//! The GPU runs the text; `lanes` runs naga's form of the same text on the CPU.

mod check;
mod compose;
mod doc;
mod extension;
mod limits;
mod lint;
mod model;
mod own_names;
mod parameters;
mod stages;

pub use check::{Checked, ShaderError, check};
#[cfg(feature = "gpu")]
pub(crate) use compose::shader;
pub use compose::{DECAY, Precision, Recipe, Source};
pub use extension::{extension_named, laws, library, read_extension};
pub use model::{ModelError, law_file, law_with, read_law, read_model};
pub(crate) use own_names::memory_of;
pub use own_names::{is_member, member};
