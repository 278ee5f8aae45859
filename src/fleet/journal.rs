//! The rows that are there, as they were found: a line each behind a first one that says what they are of.
//!
//! A process that is killed leaves a last line that is cut; it is taken off by whoever goes on.

use super::{Place, Row, SCHEMA_VERSION};
use crate::text::bounded::Lines;
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
pub enum JournalError {
    /// Reading or writing failed.
    #[error("{path}: cannot {doing} the journal of the fleet: {source}")]
    Io {
        /// The file.
        path: String,
        /// What was tried.
        doing: &'static str,
        /// Why.
        source: io::Error,
    },
    /// Another process has it.
    #[error("{0}: another run works on this fleet; wait for it, or give another --out")]
    Busy(String),
    /// It is of other data or other settings.
    #[error(
        "{0}: the folder holds a fleet of other data, settings or program; expected the same command to go on with it, or another --out"
    )]
    Other(String),
    /// A line in the middle is no row.
    #[error("{path}:{line}: expected a row of a fleet, found something else; give another --out, or remove the folder")]
    Broken {
        /// The file.
        path: String,
        /// The line.
        line: usize,
    },
}

impl Journal {
    /// Opens a journal for what has this key, or makes it.
    ///
    /// # Errors
    /// When it is of something else, in use, broken, or cannot be read or written.
    pub fn open(path: &Path, key: &str) -> Result<Journal, JournalError> {
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
            if line.pop_if(|last| *last == b'\n').is_none() {
                // Of a file without a whole line, only the beginning of an own one is taken for a journal.
                if number == 0 && !own.as_bytes().starts_with(&line) {
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
                let row: Row =
                    serde_json::from_slice(&line).map_err(|_| JournalError::Broken { path: shown(), line: number })?;
                known.insert(row.place, row);
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
            rmse: [1.0; 3],
            nrmse: [0.1; 3],
            parameters: vec![1.0 / 3.0, 2.0],
            at_bound: vec!["v_0".to_owned()],
            intervals: Some(vec![Some([0.1, 0.3]), None]),
            evaluations: 100,
            stop: "converged".to_owned(),
        };
        let place = Place { pair, model: 0, measure: 0 };
        Row { place, found: if pair == 2 { Err("too short".to_owned()) } else { Ok(found) } }
    }

    #[test]
    fn rows_come_back_and_a_cut_line_is_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("journal.jsonl");
        let rows: Vec<Row> = (0..4).map(row).collect();
        Journal::open(&path, "k").expect("new").add(&rows).expect("room");
        let known = |path: &Path| Journal::open(path, "k").expect("whole").known.into_values().collect::<Vec<_>>();
        assert_eq!(known(&path), rows);
        let text = std::fs::read(&path).expect("there");
        std::fs::write(&path, &text[..text.len() - 5]).expect("room");
        assert_eq!(known(&path), rows[..3]);
        Journal::open(&path, "k").expect("whole").add(&rows[3..]).expect("room");
        assert_eq!(known(&path), rows);
        assert_eq!(std::fs::read(&path).expect("there"), text);
        assert!(matches!(Journal::open(&path, "another"), Err(JournalError::Other(_))));
        let held = Journal::open(&path, "k").expect("whole");
        assert!(matches!(Journal::open(&path, "k"), Err(JournalError::Busy(_))));
        drop(held);
        std::fs::write(&path, "notes of somebody").expect("room");
        assert!(matches!(Journal::open(&path, "k"), Err(JournalError::Other(_))));
        assert_eq!(std::fs::read(&path).expect("there"), b"notes of somebody", "it is left alone");
        std::fs::write(&path, [&text[..], b"what?\n"].concat()).expect("room");
        assert!(matches!(Journal::open(&path, "k"), Err(JournalError::Broken { line: 6, .. })));
    }
}
