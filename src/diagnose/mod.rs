//! What a simulation gets wrong, and why: from measured drives to a named cause, an extended model and its gain.
//!
//! A [`Drive`] is one measured run ready for diagnosis; the method and its figures are in `docs/DIAGNOSIS.md`.

pub mod budget;
pub mod data;
pub mod drive;
pub mod formula;
mod fourier;
pub mod free;
pub mod gain;
pub mod hold_back;
pub mod missing;
pub mod outcome;
pub mod scene;
pub mod wide;

pub use drive::{Drive, DriveError, Jump};
