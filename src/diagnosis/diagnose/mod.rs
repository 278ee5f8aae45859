//! Diagnosis of a model: from measured drives to a named cause, an extended model and its gain.
//!
//! A [`Drive`] is one measured run ready for diagnosis, and [`infer()`] searches for the cause; `docs/DIAGNOSIS.md` has the method and its
//! numbers.

pub mod answer;
pub use crate::trajectory::soundness as data;
pub mod describe;
pub mod drive;
mod infer;
pub mod judge;
pub mod likelihood;
#[cfg(test)]
pub(crate) mod made_up;
pub mod outcome;
pub mod policy;
pub mod question;
mod revision;
pub mod search;
pub mod select;
mod watching;

pub use drive::{Drive, DriveError, Jump};
pub use infer::{infer, infer_with};
pub use likelihood::observer::Noise;
pub use outcome::{Adopted, Estimate, Fitted, Inference, LeftOver, NotTestable, Tried, Verdict};
pub use policy::{POLICY, Policy};
pub use question::{DiagnoseError, Effort, Progress, Question};
pub use revision::{DIAGNOSIS_REVISION, PROGRAM};
pub use watching::Watching;
