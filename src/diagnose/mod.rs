//! What a simulation gets wrong, and why: from measured drives to a named cause, an extended model and its gain.
//!
//! A [`Drive`] is one measured run ready for diagnosis; the method and its figures are in `docs/DIAGNOSIS.md`.

pub mod data;
pub mod drive;
mod fourier;

pub use drive::{Drive, DriveError, Jump};
