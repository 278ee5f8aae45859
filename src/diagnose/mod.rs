//! What a simulation gets wrong, and why: from measured drives to a named cause, an extended model and its gain.
//!
//! A [`Drive`] is one measured run ready for diagnosis, [`infer()`] the search for the cause; the method and its figures are in
//! `docs/DIAGNOSIS.md`.

use std::sync::LazyLock;

mod absent;
pub mod adopt;
mod anew;
mod answer;
pub mod base;
mod bootstrap;
pub mod budget;
pub mod candidate;
pub mod data;
pub mod decide;
pub mod drive;
pub mod drivers;
mod equilibrium;
pub mod family;
pub mod fate;
pub mod fit;
pub mod fold;
pub mod formula;
mod fourier;
pub mod free;
pub mod gain;
pub mod gate;
pub mod gram;
mod held_sizes;
mod hidden;
mod infer;
pub mod known;
pub mod likelihood;
#[cfg(test)]
mod made_up;
pub mod missing;
pub mod model;
pub mod observer;
mod polish;
mod repair;
pub mod road;
pub mod scan;
pub mod scene;
mod scope;
pub mod screen;
mod smoothing;
pub mod space;
pub mod specification;
pub mod spending;
mod standstill;
pub mod start;
mod streams;
mod trial;
mod undisturbed;
pub mod verdict;

#[cfg(feature = "cli")]
pub(crate) use bootstrap::{JUDGED, one_in_a_hundred};
pub use drive::{Drive, DriveError, Jump};
pub use infer::{infer, infer_with};
pub use observer::Noise;
pub use verdict::{
    Adopted, DiagnoseError, Effort, Estimate, Fitted, Inference, LeftOver, NotTestable, Progress, Question, Tried,
    Verdict,
};

/// State of the diagnosis. To be raised whenever a diagnosis of the same data may end otherwise: with another name, another number,
/// after another search. Journals and the thresholds of a bootstrap hold it, so that results of two states never stand side by side as
/// if they were of one. What came before 2 wrote none down.
pub const DIAGNOSIS_REVISION: u32 = 21;

/// Program, version and state of the diagnosis, `leadlag 0.1.0+diagnosis2`.
pub static PROGRAM: LazyLock<String> =
    LazyLock::new(|| format!("leadlag {}+diagnosis{DIAGNOSIS_REVISION}", env!("CARGO_PKG_VERSION")));
