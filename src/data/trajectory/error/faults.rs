//! Values that disqualify one car of a file, and not the others.

use super::problem::Problem;
use super::{PROBLEMS_SHOWN, list};

/// The first problems with a file's values, and the number of the others.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Faults {
    pub(in crate::trajectory) first: Vec<Problem>,
    pub(in crate::trajectory) more: u64,
}

impl Faults {
    /// True without a fault.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// One line per problem, each with its place in the file `path`.
    #[must_use]
    pub fn told(&self, path: &str) -> String {
        list(path, &self.first, self.more)
    }

    pub(in crate::trajectory) fn add(&mut self, problem: Problem) {
        if self.first.len() < PROBLEMS_SHOWN {
            self.first.push(problem);
        } else {
            self.more += 1;
        }
    }

    /// Adds the problems of `other`; the first ones in file order are kept.
    pub(in crate::trajectory) fn merge(&mut self, other: Faults) {
        self.first.extend(other.first);
        self.first.sort_by_key(|problem| (problem.line, problem.column));
        let beyond = self.first.len().saturating_sub(PROBLEMS_SHOWN);
        self.first.truncate(PROBLEMS_SHOWN);
        self.more += other.more + beyond as u64;
    }
}
