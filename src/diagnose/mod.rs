//! What a simulation gets wrong, and why: from measured drives to a named cause, an extended model and its gain.
//!
//! A [`Drive`] is one measured run ready for diagnosis, [`infer`] the search for the cause; the method and its figures are in
//! `docs/DIAGNOSIS.md`.

pub mod adopt;
pub mod base;
pub mod candidate;
pub mod decide;
pub mod drive;
pub mod family;
pub mod fit;
pub mod fold;
pub mod gram;
mod infer;
pub mod likelihood;
pub mod model;
pub mod observer;
pub mod screen;
pub mod space;
pub mod specification;
pub mod start;
pub mod verdict;

pub use drive::{Drive, DriveError, Jump};
pub use infer::infer;
pub use observer::Noise;
pub use verdict::{
    Adopted, DiagnoseError, Effort, Estimate, Fitted, Inference, LeftOver, NotTestable, Progress, Question, Tried,
    Verdict,
};
