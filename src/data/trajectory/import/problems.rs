//! Collects the problems of one file while it is being read.

use crate::trajectory::error::{Faults, ImportError, Problem, ProblemKind};
use std::io;

/// Reading cannot continue.
#[derive(Debug)]
pub(in crate::trajectory) enum Stop {
    /// The reason is the last of the collected problems.
    Rejected,
    /// The medium failed at this line.
    Io(u64, io::Error),
}

/// Problems found so far.
#[derive(Debug, Default)]
pub(in crate::trajectory) struct Problems {
    found: Faults,
}

impl Problems {
    /// Records a problem; reading may continue.
    pub fn add(&mut self, line: u64, column: Option<usize>, kind: ProblemKind) {
        self.found.add(Problem { line, column, kind });
    }

    /// Adds the faults of single cars, for a file without a usable car.
    pub fn adopt(&mut self, faults: impl IntoIterator<Item = Faults>) {
        faults.into_iter().for_each(|faults| self.found.merge(faults));
    }

    /// Records a problem after which reading cannot continue.
    pub fn stop(&mut self, line: u64, column: Option<usize>, kind: ProblemKind) -> Stop {
        self.add(line, column, kind);
        Stop::Rejected
    }

    /// Stops if there is any problem so far.
    pub fn check(&self) -> Result<(), Stop> {
        if self.found.is_empty() { Ok(()) } else { Err(Stop::Rejected) }
    }

    /// The result of reading `path`: an error if anything was found.
    pub fn finish<T>(self, path: &str, result: Result<T, Stop>) -> Result<T, ImportError> {
        match result {
            Err(Stop::Io(line, source)) => Err(ImportError::Read { path: path.to_owned(), line, source }),
            Ok(value) if self.found.is_empty() => Ok(value),
            _ => {
                let (problems, more) = self.found.summarised();
                Err(ImportError::Rejected { path: path.to_owned(), problems, more })
            }
        }
    }
}
