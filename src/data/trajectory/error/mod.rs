//! Errors of the data layer: the fault of a file, its place, and the remedy.
//!
//! Reading reports the first [`PROBLEMS_SHOWN`] problems of a file, each with line and column.

mod faults;
mod prepare;
pub(crate) mod problem;

pub use faults::Faults;
pub use prepare::PrepareError;
pub(super) use prepare::step_too_long;
pub use problem::{Problem, ProblemKind};

use crate::text::shown::counted;
use std::io;

/// A file with more problems than this reports only their number beyond it.
pub const PROBLEMS_SHOWN: usize = 10;

/// A file of measured data could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    #[error("{path}: expected a readable file")]
    Open { path: String, source: io::Error },
    #[error("{path}: expected a file, found a folder; name the files in it")]
    Folder { path: String },
    #[error("{path}:{line}: reading stopped here")]
    Read { path: String, line: u64, source: io::Error },
    #[error("{}", list(path, problems, *more))]
    Rejected { path: String, problems: Vec<Problem>, more: u64 },
}

/// One line per problem, each with its place: `file:line:column: message`.
fn list(path: &str, problems: &[Problem], more: u64) -> String {
    let mut lines: Vec<String> = problems
        .iter()
        .map(|problem| match problem.column {
            Some(column) => format!("{path}:{}:{column}: {}", problem.line, problem.kind),
            None => format!("{path}:{}: {}", problem.line, problem.kind),
        })
        .collect();
    if more > 0 {
        lines.push(format!("{path}: and {}", counted(more, "more problem")));
    }
    lines.join("\n")
}
