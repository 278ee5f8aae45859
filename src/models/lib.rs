//! Models and everything that evaluates them: reference, lanes and GPU; optimisers and calibration; the generator of synthetic drives.
//!
//! Part of leadlag. Its interface may change with any version; depend on `leadlag`.

pub mod by_hand;
pub mod calibrate;
pub mod catalog;
pub mod convention;
pub mod evaluate;
pub mod evaluator;
pub mod extension;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod identify;
pub mod lanes;
pub mod optimize;
pub mod reference;
pub mod rescore;
pub mod score;
pub mod select;
pub mod simulate;
pub mod symbols;
pub mod synthetic;
pub mod wgsl;

use leadlag_data::{text, trajectory, vehicle};
