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

use super::BenchError;
use super::journal::Journal;
use std::ops::ControlFlow;

/// Runs the cases that the journal lacks by [`diagnose_task`] or [`infer_task`]; `progress` gets the number of finished cases and the next
/// case, and can stop the run.
///
/// # Errors
/// [`BenchError::Write`] when the journal cannot be written. A case whose generation or diagnosis fails is an outcome.
pub fn run_diagnoses(
    tasks: &[DiagnosisTask],
    journal: &mut Journal<DiagnosisOutcome>,
    diagnose: fn(&DiagnosisTask) -> DiagnosisOutcome,
    progress: &mut dyn FnMut(usize, &DiagnosisTask) -> ControlFlow<()>,
) -> Result<(), BenchError> {
    for (done, task) in tasks.iter().enumerate() {
        if progress(done, task).is_break() {
            return Ok(());
        }
        if journal.get(task).is_none() {
            journal.keep(diagnose(task))?;
        }
    }
    Ok(())
}
