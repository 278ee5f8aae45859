//! The rows of a table of pairs or platoons: time rises within a group, and where it starts over, another trajectory begins.

use crate::trajectory::error::{Faults, Problem, ProblemKind};
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::prepare::SEGMENT_MIN_S;
use std::collections::HashMap;

/// Time and place of a row.
pub(super) struct Row {
    /// NaN for a row whose time is refused.
    pub time: f64,
    pub line: u64,
    /// Character at which the time starts.
    pub column: Option<usize>,
    /// Key that distinguishes it from another row of the same time.
    pub hash: u64,
}

/// The times of a trajectory so far.
#[derive(Default)]
struct Axis {
    number: u32,
    times: Vec<f64>,
    lines: Vec<u64>,
    hashes: Vec<u64>,
}

/// All trajectories of a table.
pub(super) struct Trajectories {
    /// Name of the column of the time.
    time: String,
    has_group: bool,
    axes: HashMap<String, Axis>,
    count: u32,
    /// True if the columns that are not read cannot distinguish trajectories.
    is_certain: bool,
    faults: Faults,
    /// Of a table without groups: the first time that does not rise, with the one before, and the first that starts over.
    back: Option<(u64, f64, f64)>,
    anew: Option<(u64, f64)>,
}

impl Trajectories {
    pub fn new(time: String, has_group: bool, is_certain: bool) -> Self {
        let axes = HashMap::new();
        Trajectories { time, has_group, is_certain, axes, count: 0, faults: Faults::default(), back: None, anew: None }
    }

    /// The number of the trajectory of a row; `None` for a row that repeats another one exactly. If a table without groups starts over,
    /// reading stops, unless an unread column may distinguish its trajectories: `is_one` says that none does.
    pub fn add(
        &mut self,
        row: Row,
        group: &str,
        is_one: impl Fn() -> bool,
        problems: &mut Problems,
    ) -> Result<Option<u32>, Stop> {
        if !self.axes.contains_key(group) {
            self.axes.insert(group.to_owned(), Axis { number: self.count, ..Axis::default() });
            self.count += 1;
        }
        let axis = self.axes.get_mut(group).expect("it was just put there");
        let Row { time, line, column, hash } = row;
        if time.is_nan() {
            return Ok(Some(axis.number));
        }
        let twice = axis.times.binary_search_by(|other| other.total_cmp(&time)).ok();
        if twice.is_some_and(|twice| axis.hashes[twice] == hash) {
            return Ok(None);
        }
        let (first, last) = (axis.times.first().copied(), axis.times.last().copied());
        if let Some(previous) = last.filter(|last| time <= *last) {
            self.back.get_or_insert((line, previous, time));
        }
        let lasts = first.zip(last).is_some_and(|(first, last)| last - first >= SEGMENT_MIN_S);
        if lasts && first.is_some_and(|first| time <= first) {
            if !self.has_group {
                self.anew.get_or_insert((line, time));
                if is_one() {
                    return Err(self.starts_over((line, time), problems));
                }
            }
            *axis = Axis { number: self.count, ..Axis::default() };
            self.count += 1;
        } else {
            let kind = match (twice, last) {
                (Some(twice), _) => {
                    Some(ProblemKind::TimeTwice { column: self.time.clone(), found: time, first: axis.lines[twice] })
                }
                (None, Some(previous)) if time < previous => {
                    Some(ProblemKind::TimeBack { column: self.time.clone(), previous, found: time })
                }
                _ => None,
            };
            if let Some(kind) = kind {
                match self.is_certain {
                    true => problems.add(line, column, kind),
                    false => self.faults.add(Problem { line, column, kind }),
                }
                return Ok(Some(axis.number));
            }
        }
        axis.times.push(time);
        axis.lines.push(line);
        axis.hashes.push(hash);
        Ok(Some(axis.number))
    }

    fn starts_over(&self, (line, found): (u64, f64), problems: &mut Problems) -> Stop {
        problems.stop(line, None, ProblemKind::TimeAnew { column: self.time.clone(), found })
    }

    /// The faults of the times; one message in place of one per row if the columns `guess` may distinguish trajectories.
    pub fn finish(self, guess: Vec<&str>, problems: &mut Problems) -> Result<(), Stop> {
        match (self.back, self.anew) {
            (Some((line, previous, found)), _) if !self.has_group && !guess.is_empty() => {
                let guess = guess.into_iter().map(str::to_owned).collect();
                problems.add(line, None, ProblemKind::NoGroup { column: self.time, previous, found, guess });
                Ok(())
            }
            (_, Some(anew)) => Err(self.starts_over(anew, problems)),
            _ => {
                problems.adopt([self.faults]);
                Ok(())
            }
        }
    }
}
