//! Finished tasks, one JSON object per line.

use super::BenchError;
use serde::{Serialize, de::DeserializeOwned};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;

/// Result of a task, which depends only on the settings of the task and on the program.
pub trait Outcome: Serialize + DeserializeOwned {
    /// The settings.
    type Task: Ord + Clone;
    fn task(&self) -> &Self::Task;
    /// The program, with the revision on which results depend.
    fn program(&self) -> &str;
    /// The same of this program.
    fn this_program() -> &'static str;
}

/// Finished tasks, in memory and in a file, so that a stopped run can continue.
#[derive(Debug)]
pub struct Journal<O: Outcome> {
    path: String,
    file: File,
    outcomes: BTreeMap<O::Task, O>,
}

impl<O: Outcome> Journal<O> {
    /// Opens a journal, or starts one. It drops an incomplete line, which a killed run leaves, and skips lines of another program.
    ///
    /// # Errors
    /// [`BenchError::Write`] when the file cannot be read and written.
    pub fn open(path: &Path) -> Result<Journal<O>, BenchError> {
        let path = path.display().to_string();
        let error = |source| BenchError::Write { path: path.clone(), source };
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(&path).map_err(error)?;
        let mut text = String::new();
        crate::text::bounded::Lines::new(&mut file).read_to_string(&mut text).map_err(error)?;
        if !text.is_empty() && !text.ends_with('\n') {
            file.write_all(b"\n").map_err(error)?;
        }
        let read = text.lines().filter_map(|line| serde_json::from_str::<O>(line).ok());
        let own = read.filter(|outcome| outcome.program() == O::this_program());
        let outcomes = own.map(|outcome| (outcome.task().clone(), outcome)).collect();
        Ok(Journal { path, file, outcomes })
    }

    /// Result of a task, if it is done.
    #[must_use]
    pub fn get(&self, task: &O::Task) -> Option<&O> {
        self.outcomes.get(task)
    }

    /// Adds a finished task.
    pub(super) fn keep(&mut self, outcome: O) -> Result<(), BenchError> {
        let mut line = serde_json::to_string(&outcome).expect("names and finite numbers are valid JSON");
        line.push('\n');
        let error = |source| BenchError::Write { path: self.path.clone(), source };
        self.file.write_all(line.as_bytes()).map_err(error)?;
        self.outcomes.insert(outcome.task().clone(), outcome);
        Ok(())
    }
}
