//! Finished tasks, one JSON object per line.

use super::super::BenchError;
use super::{OptimizerOutcome, OptimizerTask};
use crate::calibrate::PROGRAM;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// Finished tasks, in memory and in a file.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    outcomes: BTreeMap<OptimizerTask, OptimizerOutcome>,
}

impl Journal {
    /// Opens a journal, or starts one. It drops an incomplete line, which a killed run leaves.
    ///
    /// # Errors
    /// [`BenchError::Write`] when the file cannot be read and written.
    pub fn open(path: &Path) -> Result<Journal, BenchError> {
        let error = |source| BenchError::Write { path: path.display().to_string(), source };
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path).map_err(error)?;
        let mut text = String::new();
        crate::text::bounded::Lines::new(&mut file).read_to_string(&mut text).map_err(error)?;
        if !text.is_empty() && !text.ends_with('\n') {
            file.write_all(b"\n").map_err(error)?;
        }
        let read = text.lines().filter_map(|line| serde_json::from_str::<OptimizerOutcome>(line).ok());
        // Another version, or another state of the search, gives different results.
        let outcomes =
            read.filter(|outcome| outcome.program == *PROGRAM).map(|outcome| (outcome.task.clone(), outcome)).collect();
        Ok(Journal { path: path.to_owned(), file, outcomes })
    }

    /// True if the task is done.
    #[must_use]
    pub fn has(&self, task: &OptimizerTask) -> bool {
        self.outcomes.contains_key(task)
    }

    /// Result of a task.
    #[must_use]
    pub fn get(&self, task: &OptimizerTask) -> Option<&OptimizerOutcome> {
        self.outcomes.get(task)
    }

    /// Adds a finished task.
    pub(super) fn keep(&mut self, outcome: OptimizerOutcome) -> Result<(), BenchError> {
        let mut line = serde_json::to_string(&outcome).expect("names and finite numbers are valid JSON");
        line.push('\n');
        let error = |source| BenchError::Write { path: self.path.display().to_string(), source };
        self.file.write_all(line.as_bytes()).map_err(error)?;
        self.outcomes.insert(outcome.task.clone(), outcome);
        Ok(())
    }
}
