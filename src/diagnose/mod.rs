//! What a simulation gets wrong, and why: from measured drives to a named cause, an extended model and its gain.
//!
//! A [`Drive`] is one measured run ready for diagnosis; the method and its figures are in `docs/DIAGNOSIS.md`.

pub mod drive;
pub mod fit;
pub mod fold;
pub mod gram;
pub mod likelihood;
pub mod observer;
pub mod space;

pub use drive::{Drive, DriveError, Jump};
