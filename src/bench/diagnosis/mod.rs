//! How well a diagnosis names a missing effect: effects planted in synthetic drives, and drives without an effect.
//!
//! A seed determines everything: base, parameters, leader, noise, effect. Each finished case is one line of a journal, so that a stopped
//! run can continue.

mod judge;
mod plan;
mod report;
mod synthetic;
mod text;

pub use judge::{DiagnosisOutcome, Judgement, diagnose_task, infer_task, judge};
pub use plan::{DiagnosisTask, LARGEST_SEED, SIZES, diagnosis_tasks};
pub use report::DiagnosisReport;
pub use synthetic::{Planted, planted};
