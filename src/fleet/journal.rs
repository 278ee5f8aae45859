//! The finished rows, one line each, after a line that identifies the fleet.
//!
//! A process that is killed leaves an incomplete last line; the next process removes it.

use super::{Place, Row, SCHEMA_VERSION};
use crate::text::bounded::Lines;
use crate::text::option::OUT;
use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The file.
#[derive(Debug)]
pub struct Journal {
    /// None: nothing is kept.
    file: Option<(PathBuf, Mutex<File>)>,
    /// The rows that it had when it was opened.
    known: BTreeMap<Place, Row>,
}

#[derive(serde::Serialize, serde::Deserialize)]
struct Head {
    schema_version: u32,
    key: String,
}

/// A journal that cannot be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum JournalError {
    #[error("{path}: cannot {doing} the journal of the fleet: {source}")]
    Io { path: String, doing: &'static str, source: io::Error },
    #[error("{0}: another run works on this fleet; wait for it, or give another {OUT}")]
    Busy(String),
    #[error(
        "{0}: the folder holds a fleet of other data, settings or program; expected the same command to continue it, or another {OUT}"
    )]
    Other(String),
    #[error("{path}:{line}: not a calibration of this fleet: {reason}; remove the line, and it is calibrated again")]
    Broken { path: String, line: usize, reason: String },
}

impl Journal {
    /// Opens the journal of this key, or creates it; `misfit` says why a row cannot be one of the fleet.
    ///
    /// # Errors
    /// If it belongs to another fleet, is in use or broken, or cannot be read or written.
    pub fn open(path: &Path, key: &str, misfit: &dyn Fn(&Row) -> Option<String>) -> Result<Journal, JournalError> {
        let shown = || path.display().to_string();
        let io = |doing| move |source| JournalError::Io { path: path.display().to_string(), doing, source };
        let file = File::options().read(true).append(true).create(true).open(path).map_err(io("open"))?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(JournalError::Busy(shown()));
        }
        let head = Head { schema_version: SCHEMA_VERSION, key: key.to_owned() };
        let own = serde_json::to_string(&head).expect("numbers and text can be written");
        let (mut whole, mut known, mut number) = (0, BTreeMap::new(), 0);
        let mut lines = BufReader::new(Lines::new(&file));
        loop {
            let mut line = Vec::new();
            lines.read_until(b'\n', &mut line).map_err(io("read"))?;
            // After a power failure a file may have zeros in place of missing bytes; the pairs after them are calibrated again.
            let arrived = line.iter().position(|byte| *byte == 0);
            if arrived.is_some() || line.pop_if(|last| *last == b'\n').is_none() {
                // A file without a complete line counts as a journal only if it begins like one.
                if number == 0 && !own.as_bytes().starts_with(&line[..arrived.unwrap_or(line.len())]) {
                    return Err(JournalError::Other(shown()));
                }
                break;
            }
            number += 1;
            if number == 1 {
                let head: Head = serde_json::from_slice(&line).map_err(|_| JournalError::Other(shown()))?;
                if head.key != key || head.schema_version != SCHEMA_VERSION {
                    return Err(JournalError::Other(shown()));
                }
            } else {
                let broken = |reason| JournalError::Broken { path: shown(), line: number, reason };
                let row: Row = serde_json::from_slice(&line).map_err(|error| broken(error.to_string()))?;
                match misfit(&row) {
                    Some(reason) => return Err(broken(reason)),
                    None => known.insert(row.place, row),
                };
            }
            whole += line.len() as u64 + 1;
        }
        file.set_len(whole).map_err(io("repair"))?;
        let journal = Journal { file: Some((path.to_owned(), Mutex::new(file))), known };
        if number == 0 {
            journal.write(&head)?;
        }
        Ok(journal)
    }

    /// A journal that keeps nothing.
    #[must_use]
    pub fn none() -> Journal {
        Journal { file: None, known: BTreeMap::new() }
    }

    /// The rows that were there when it was opened.
    #[must_use]
    pub fn known(&self) -> &BTreeMap<Place, Row> {
        &self.known
    }

    /// Adds rows.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn add(&self, rows: &[Row]) -> Result<(), JournalError> {
        rows.iter().try_for_each(|row| self.write(row))
    }

    fn write(&self, entry: &impl serde::Serialize) -> Result<(), JournalError> {
        let Some((path, file)) = &self.file else { return Ok(()) };
        let line = serde_json::to_string(entry).expect("numbers and text can be written") + "\n";
        let mut file = file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        // One call per line: a process that is killed cuts the last one at most.
        file.write_all(line.as_bytes()).map_err(|source| JournalError::Io {
            path: path.display().to_string(),
            doing: "write",
            source,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::Found;

    fn row(pair: usize) -> Row {
        let found = Found {
            score: 0.1 + pair as f64 / 3.0,
            rmse: [Some(1.0); 3],
            nrmse: [Some(0.1), Some(1.0 / 3.0), None],
            parameters: vec![1.0 / 3.0, 2.0],
            at_bound: vec!["v_0".to_owned()],
            intervals: Some(vec![Some([0.1, 0.3]), None]),
            optimism: Some(crate::identify::Optimism { score: 0.01, noise: 1.0 / 3.0 }),
            evaluations: 100,
            stop: "converged".to_owned(),
        };
        let place = Place { pair, model: 0, measure: 0 };
        Row { place, found: if pair == 2 { Err("too short".to_owned()) } else { Ok(found) } }
    }

    fn open(path: &Path, key: &str) -> Result<Journal, JournalError> {
        Journal::open(path, key, &|row| (row.place.pair > 9).then(|| "expected fewer".to_owned()))
    }

    #[test]
    fn rows_come_back_and_a_cut_line_is_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("journal.jsonl");
        let rows: Vec<Row> = (0..4).map(row).collect();
        open(&path, "k").expect("new").add(&rows).expect("room");
        let known = |path: &Path| open(path, "k").expect("whole").known.into_values().collect::<Vec<_>>();
        assert_eq!(known(&path), rows);
        let text = std::fs::read(&path).expect("there");
        std::fs::write(&path, &text[..text.len() - 5]).expect("room");
        assert_eq!(known(&path), rows[..3]);
        open(&path, "k").expect("whole").add(&rows[3..]).expect("room");
        assert_eq!(known(&path), rows);
        assert_eq!(std::fs::read(&path).expect("there"), text);
        assert!(matches!(open(&path, "another"), Err(JournalError::Other(_))));
        let held = open(&path, "k").expect("whole");
        assert!(matches!(open(&path, "k"), Err(JournalError::Busy(_))));
        drop(held);
        std::fs::write(&path, "notes of a user").expect("room");
        assert!(matches!(open(&path, "k"), Err(JournalError::Other(_))));
        assert_eq!(std::fs::read(&path).expect("there"), b"notes of a user", "it is left alone");
        std::fs::write(&path, [&text[..], b"what?\n"].concat()).expect("room");
        assert!(matches!(open(&path, "k"), Err(JournalError::Broken { line: 6, .. })));
    }
    /// After a power cut, zeros replace missing bytes: at the beginning, after a line, within the last one, before a complete one.
    #[test]
    fn zeros_of_a_power_cut_are_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("journal.jsonl");
        let rows: Vec<Row> = (0..3).map(row).collect();
        open(&path, "k").expect("new").add(&rows).expect("room");
        let text = std::fs::read(&path).expect("there");
        let ends: Vec<usize> = (1..=text.len()).filter(|&end| text[end - 1] == b'\n').collect();
        let zeros = [0; 4096];
        for (content, left) in [
            (zeros.to_vec(), 0),
            ([&text[..10], &zeros].concat(), 0),
            ([&text[..], &zeros].concat(), 3),
            ([&text[..ends[2] + 7], &zeros].concat(), 2),
            ([&text[..ends[1]], &zeros, &text[ends[2]..]].concat(), 1),
        ] {
            std::fs::write(&path, content).expect("room");
            let journal = open(&path, "k").expect("the rest is whole");
            assert!(journal.known().values().eq(&rows[..left]), "{left} rows are left");
            journal.add(&rows[left..]).expect("room");
            drop(journal);
            assert_eq!(std::fs::read(&path).expect("there"), text);
        }
        std::fs::write(&path, [&b"notes of a user"[..], &zeros].concat()).expect("room");
        assert!(matches!(open(&path, "k"), Err(JournalError::Other(_))));
    }

    #[test]
    fn a_row_of_another_fleet_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("journal.jsonl");
        open(&path, "k").expect("new").add(&[row(0), row(10)]).expect("room");
        let error = open(&path, "k").expect_err("there is no pair 10").to_string();
        assert!(
            error.ends_with(
                ":3: not a calibration of this fleet: expected fewer; remove the line, and it is calibrated again"
            ),
            "{error}"
        );
    }
}
