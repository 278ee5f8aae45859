//! What a simulation gets wrong, and why: from measured drives to a named cause, an extended model and its gain.
//!
//! A [`Drive`] is one measured run ready for diagnosis, [`infer()`] the search for the cause; the method and its figures are in
//! `docs/DIAGNOSIS.md`.

use std::sync::LazyLock;

mod answer;
pub mod data;
pub mod describe;
pub mod drive;
mod infer;
pub mod judge;
pub mod likelihood;
#[cfg(test)]
mod made_up;
pub mod outcome;
pub mod question;
pub mod search;
pub mod select;

pub use drive::{Drive, DriveError, Jump};
pub use infer::{infer, infer_with};
#[cfg(feature = "cli")]
pub(crate) use judge::decide::JUDGED;
pub use likelihood::observer::Noise;
pub use outcome::{Adopted, Estimate, Fitted, Inference, LeftOver, NotTestable, Tried, Verdict};
pub use question::{DiagnoseError, Effort, Progress, Question};
#[cfg(feature = "cli")]
pub(crate) use select::bootstrap::one_in_a_hundred;

/// State of the diagnosis. To be raised whenever a diagnosis of the same data may end otherwise: with another name, another number,
/// after another search. Journals and the thresholds of a bootstrap hold it, so that results of two states never stand side by side as
/// if they were of one. What came before 2 wrote none down.
pub const DIAGNOSIS_REVISION: u32 = 21;

/// Program, version and state of the diagnosis, `leadlag 0.1.0+diagnosis2`.
pub static PROGRAM: LazyLock<String> =
    LazyLock::new(|| format!("leadlag {}+diagnosis{DIAGNOSIS_REVISION}", env!("CARGO_PKG_VERSION")));
