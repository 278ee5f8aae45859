//! Finished units of work, one JSON object per line of a file.
//!
//! A process that is killed leaves an incomplete last line; the next process removes it.

use crate::text::bounded::Lines;
use crate::text::option::{JOURNAL, OUT, Opt};
use serde::{Serialize, de::DeserializeOwned, de::IgnoredAny};
use serde_json::json;
use std::collections::BTreeMap;
use std::fs::{File, TryLockError};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

/// Version of the line that says what a journal belongs to.
const SCHEMA_VERSION: u32 = 1;

/// The result of a unit of work.
pub trait Entry: Serialize + DeserializeOwned + Clone {
    /// Identifies the unit among those of its journal.
    type Key: Ord + Clone + Sync;
    fn key(&self) -> &Self::Key;
}

/// Finished units, in memory and in a file, so that a stopped run can continue.
#[derive(Debug)]
pub struct Journal<E: Entry> {
    /// None: nothing outlives the process.
    file: Option<(PathBuf, File)>,
    entries: BTreeMap<E::Key, E>,
}

/// A journal that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    #[error("{path}: cannot {doing} the journal: {source}")]
    Io { path: String, doing: &'static str, source: io::Error },
    #[error("{path}: another run works on it; wait for it, or give another {option}")]
    Busy { path: String, option: Opt },
    #[error(
        "{0}: the folder holds a fleet of other data, settings or program; expected the same command to continue it, or another {OUT}"
    )]
    Other(String),
    #[error("{0}: expected a journal, a JSON object per line, found another file; give another {JOURNAL}")]
    Foreign(String),
    #[error("{path}:{line}: not a calibration of this fleet: {reason}; remove the line, and it is calibrated again")]
    Broken { path: String, line: usize, reason: String },
}

/// The beginning of every line of a journal without a key.
const KEYLESS: &[u8] = b"{\"program\":";

/// Reads a line: the entry, `None` for a line to be skipped, or why it cannot be an entry.
type Read<'a, E> = dyn Fn(&[u8]) -> Result<Option<E>, String> + 'a;

impl<E: Entry> Journal<E> {
    /// Opens a journal, or creates it. With a `key`, its first line has to have this key, and every line has to be an entry; without, it may have the
    /// lines of other runs, too. Fails if it belongs to another key, is in use or broken, or cannot be read or written.
    pub fn open(path: &Path, key: Option<&str>, read: &Read<E>) -> Result<Journal<E>, JournalError> {
        let shown = || path.display().to_string();
        let io = |doing| move |source| JournalError::Io { path: path.display().to_string(), doing, source };
        let file = File::options().read(true).append(true).create(true).open(path).map_err(io("open"))?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let option = if key.is_some() { OUT } else { JOURNAL };
            return Err(JournalError::Busy { path: shown(), option });
        }
        let head = key.map(|key| json!({ "schema_version": SCHEMA_VERSION, "key": key }).to_string());
        let (mut whole, mut entries, mut number, mut is_unended) = (0, BTreeMap::new(), 0, false);
        let mut lines = BufReader::new(Lines::new(&file));
        loop {
            let mut line = Vec::new();
            lines.read_until(b'\n', &mut line).map_err(io("read"))?;
            // After a power failure a file may have zeros in place of missing bytes; the units after them are done again.
            let arrived = line.iter().position(|byte| *byte == 0);
            let is_ended = line.pop_if(|last| *last == b'\n').is_some();
            // A line may be whole without its end: editors remove the last one.
            let is_whole = is_ended || serde_json::from_slice::<IgnoredAny>(&line).is_ok();
            if arrived.is_some() || !is_whole {
                // A rest that does not begin like a line of a journal stays.
                let begun = &line[..arrived.unwrap_or(line.len())];
                let is_own = |start: &[u8]| start.starts_with(begun) || begun.starts_with(start);
                match &head {
                    Some(head) if number == 0 && !head.as_bytes().starts_with(begun) => {
                        return Err(JournalError::Other(shown()));
                    }
                    None if !is_own(KEYLESS) => return Err(JournalError::Foreign(shown())),
                    _ => break,
                }
            }
            if head.is_none() && !line.starts_with(KEYLESS) {
                return Err(JournalError::Foreign(shown()));
            }
            number += 1;
            if let (1, Some(head)) = (number, &head) {
                if line != head.as_bytes() {
                    return Err(JournalError::Other(shown()));
                }
            } else {
                let broken = |reason| JournalError::Broken { path: shown(), line: number, reason };
                entries.extend(read(&line).map_err(broken)?.map(|entry| (entry.key().clone(), entry)));
            }
            whole += line.len() as u64 + u64::from(is_ended);
            is_unended = !is_ended;
        }
        if whole != file.metadata().map_err(io("read"))?.len() {
            file.set_len(whole).map_err(io("repair"))?;
        }
        let mut journal = Journal { file: Some((path.to_owned(), file)), entries };
        if is_unended {
            journal.write("")?;
        }
        if let (0, Some(head)) = (number, &head) {
            journal.write(head)?;
        }
        Ok(journal)
    }

    /// A journal that only this process has.
    pub fn none() -> Journal<E> {
        Journal { file: None, entries: BTreeMap::new() }
    }

    /// The result of a unit, if it is done.
    pub fn get(&self, key: &E::Key) -> Option<&E> {
        self.entries.get(key)
    }

    /// The same, removed from memory.
    pub fn take(&mut self, key: &E::Key) -> Option<E> {
        self.entries.remove(key)
    }

    /// Number of finished units.
    pub fn count(&self) -> usize {
        self.entries.len()
    }

    /// Adds a finished unit. Fails when it cannot be written.
    pub fn keep(&mut self, entry: E) -> Result<(), JournalError> {
        self.write(&serde_json::to_string(&entry).expect("numbers and text can be written"))?;
        self.entries.insert(entry.key().clone(), entry);
        Ok(())
    }

    fn write(&mut self, line: &str) -> Result<(), JournalError> {
        let Some((path, file)) = &mut self.file else { return Ok(()) };
        // One call per line: a process that is killed cuts the last one at most.
        let failed = |source| JournalError::Io { path: path.display().to_string(), doing: "write", source };
        file.write_all(format!("{line}\n").as_bytes()).map_err(failed)
    }
}
