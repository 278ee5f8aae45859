//! Values that disqualify one car of a file, and not the others.

use super::problem::{Problem, ProblemKind};
use super::{PROBLEMS_SHOWN, list};

/// The first problems with a file's values, and the number of the others.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Faults {
    pub(in crate::trajectory) first: Vec<Problem>,
    pub(in crate::trajectory) more: u64,
    /// The value out of range of each column.
    outside: Vec<Outside>,
    /// Rows that have the time of an earlier row.
    times_twice: u64,
}

/// The values of a column that no car can have.
#[derive(Debug, Clone, PartialEq)]
struct Outside {
    column: String,
    /// The first one.
    value: f64,
    rows: u64,
    /// True if all values are equal.
    only: bool,
}

/// More rows than this that have the time of the row before have rounded times.
const ROUNDED: u64 = 2;
/// A row counts as a repetition of an earlier row of the same time up to this distance \[lines\]: 100 Hz rounded to whole seconds.
const NEAR: u64 = 100;

impl Faults {
    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// One line per problem, each with its place in the file `path`.
    pub fn listed(&self, path: &str) -> String {
        let (problems, more) = self.clone().summarised();
        list(path, &problems, more)
    }

    pub(in crate::trajectory) fn add(&mut self, problem: Problem) {
        if let Some((column, value)) = problem.kind.outside() {
            self.take(Outside { column: column.to_owned(), value, rows: 1, only: true });
        }
        self.times_twice += u64::from(matches!(problem.kind, ProblemKind::TimeTwice { .. }));
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
        self.times_twice += other.times_twice;
        other.outside.into_iter().for_each(|outside| self.take(outside));
    }

    fn take(&mut self, new: Outside) {
        match self.outside.iter_mut().find(|old| old.column == new.column) {
            Some(old) => {
                old.rows += new.rows;
                old.only &= new.only && old.value == new.value;
            }
            None => self.outside.push(new),
        }
    }

    /// The problems and how many more there are. One cause is one problem: a value that stands for a missing one, or rounded times.
    pub(in crate::trajectory) fn summarised(self) -> (Vec<Problem>, u64) {
        let Faults { mut first, mut more, outside, times_twice } = self;
        let mut sum_up =
            |first: &mut Vec<Problem>, concerns: &dyn Fn(&ProblemKind) -> bool, rows: u64, kind: ProblemKind| {
                let Some(one) = first.iter().find(|problem| concerns(&problem.kind)).cloned() else { return };
                let before = first.len();
                first.retain(|problem| problem.line == one.line || !concerns(&problem.kind));
                let listed = (before - first.len()) as u64;
                first.iter_mut().filter(|problem| **problem == one).for_each(|problem| problem.kind = kind.clone());
                more = more.saturating_sub((rows - 1).saturating_sub(listed));
            };
        for Outside { column, value, rows, .. } in
            outside.into_iter().filter(|outside| outside.only && outside.rows > 1)
        {
            let is_its = |kind: &ProblemKind| kind.outside() == Some((column.as_str(), value));
            sum_up(&mut first, &is_its, rows, ProblemKind::Sentinel { column: column.clone(), found: value, rows });
        }
        let rounded = first.iter().find_map(|problem| match &problem.kind {
            ProblemKind::TimeTwice { column, first, .. } if problem.line <= first + NEAR => Some(column.clone()),
            _ => None,
        });
        if let (Some(column), true) = (rounded, times_twice > ROUNDED) {
            let is_time = |kind: &ProblemKind| matches!(kind, ProblemKind::TimeTwice { .. });
            let kind = ProblemKind::TimesRounded { column, rows: times_twice };
            sum_up(&mut first, &is_time, times_twice, kind);
        }
        (first, more)
    }
}
