//! How well a diagnosis names a missing effect: effects planted in synthetic drives, and drives without an effect.
//!
//! A seed determines everything: base, parameters, leader, noise, effect. Each finished case is one line of a journal, so that a stopped
//! run can continue.

mod judge;
mod plan;
mod plant;
mod report;
mod text;

pub use judge::{DiagnosisOutcome, Judgement, diagnose_task, infer_task, judge};
pub use plan::{DiagnosisTask, LARGEST_SEED, SIZES, diagnosis_tasks};
pub use plant::{Planted, planted};
pub use report::{Bar, DiagnosisReport, Gains, MOST_OF_IT, Power, PowerAt, Silence};

use super::BenchError;
use crate::diagnose::PROGRAM;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::ops::ControlFlow;
use std::path::Path;

/// Finished cases, in memory and in a file.
#[derive(Debug)]
pub struct DiagnosisJournal {
    path: String,
    file: File,
    outcomes: BTreeMap<DiagnosisTask, DiagnosisOutcome>,
}

impl DiagnosisJournal {
    /// Opens a journal, or starts one. It drops an incomplete line, which a killed run leaves, and skips lines of another revision of the
    /// diagnosis ([`PROGRAM`]).
    ///
    /// # Errors [`BenchError::Write`] when the file cannot be read or written.
    pub fn open(path: &Path) -> Result<DiagnosisJournal, BenchError> {
        let path = path.display().to_string();
        let error = |source| BenchError::Write { path: path.clone(), source };
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(&path).map_err(error)?;
        let mut text = String::new();
        crate::text::bounded::Lines::new(&mut file).read_to_string(&mut text).map_err(error)?;
        if !text.is_empty() && !text.ends_with('\n') {
            file.write_all(b"\n").map_err(error)?;
        }
        let read = text.lines().filter_map(|line| serde_json::from_str::<DiagnosisOutcome>(line).ok());
        let outcomes = read.filter(|outcome| outcome.program == *PROGRAM).map(|o| (o.task.clone(), o)).collect();
        Ok(DiagnosisJournal { path, file, outcomes })
    }

    /// Outcome of a case.
    #[must_use]
    pub fn get(&self, task: &DiagnosisTask) -> Option<&DiagnosisOutcome> {
        self.outcomes.get(task)
    }

    fn keep(&mut self, outcome: DiagnosisOutcome) -> Result<(), BenchError> {
        let mut line = serde_json::to_string(&outcome).expect("names and finite numbers are valid JSON");
        line.push('\n');
        let error = |source| BenchError::Write { path: self.path.clone(), source };
        self.file.write_all(line.as_bytes()).map_err(error)?;
        self.outcomes.insert(outcome.task.clone(), outcome);
        Ok(())
    }
}

/// Runs the cases that the journal lacks by [`diagnose_task`] or [`infer_task`]; `progress` gets the number of finished cases and the next
/// case, and can stop the run.
///
/// # Errors
/// [`BenchError::Write`] when the journal cannot be written. A case that cannot be made or diagnosed is an outcome.
pub fn run_diagnoses(
    tasks: &[DiagnosisTask],
    journal: &mut DiagnosisJournal,
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
