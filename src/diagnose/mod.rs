//! What a simulation gets wrong, and why: from measured drives to a named cause, an extended model and its gain.
//!
//! A [`Drive`] is one measured run ready for diagnosis, [`infer`] the search for the cause; the method and its figures are in
//! `docs/DIAGNOSIS.md`.

pub mod adopt;
pub mod base;
mod bootstrap;
pub mod budget;
pub mod candidate;
pub mod data;
pub mod decide;
pub mod describe;
pub mod drive;
mod equilibrium;
mod experiment;
pub mod family;
pub mod fate;
pub mod fit;
pub mod fold;
pub mod formula;
mod fourier;
pub mod free;
pub mod gain;
pub mod gram;
mod held_sizes;
pub mod hold_back;
mod infer;
pub mod known;
pub mod likelihood;
pub mod missing;
pub mod model;
pub mod observer;
pub mod outcome;
mod polish;
mod repair;
pub mod scan;
pub mod scene;
pub mod screen;
pub mod space;
pub mod specification;
pub mod start;
mod trial;
mod undisturbed;
pub mod verdict;

pub use adopt::family;
pub use drive::{Drive, DriveError, Jump};
pub use infer::infer;
pub use observer::Noise;
pub use verdict::{
    Adopted, DiagnoseError, Effort, Estimate, Fitted, Inference, LeftOver, NotTestable, Progress, Question, Tried,
    Verdict,
};
