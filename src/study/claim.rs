//! Claims: the tasks that each process works on, so that two runs on one folder share the work.
//!
//! A claim is a lock on an empty file. The operating system releases it when the process ends, however it ends, so a claim never
//! outlives its process. Claims only save work: without locks, a task may be done twice, with the same bytes.

use super::folder::Folder;
use std::fs::{self, File, TryLockError};
use std::path::PathBuf;

/// A task that this process works on.
#[derive(Debug)]
pub struct Claim {
    path: PathBuf,
    /// Open while locked; `None` if the file system has no locks.
    file: Option<File>,
}

impl Claim {
    /// Claims a task; `None` if another process, or another thread of this one, has it.
    pub fn take(folder: &Folder, id: &str) -> Option<Claim> {
        let path = folder.claims().join(id);
        let Ok(file) = File::options().create(true).write(true).truncate(false).open(&path) else {
            return Some(Claim { path, file: None });
        };
        match file.try_lock() {
            Ok(()) => Some(Claim { path, file: Some(file) }),
            Err(TryLockError::WouldBlock) => None,
            Err(TryLockError::Error(_)) => Some(Claim { path, file: None }),
        }
    }

    /// False if the folder has no locks: two runs on it could not detect each other.
    pub fn work(folder: &Folder) -> bool {
        // Another process holds the claim.
        let Some(claim) = Claim::take(folder, "locks") else { return true };
        let is_locked = claim.is_locked();
        claim.finish();
        is_locked
    }

    /// False if the file system has no locks, so that another process may have the same claim.
    pub fn is_locked(&self) -> bool {
        self.file.is_some()
    }

    /// Ends a claim after its part is written. The file is removed while it is locked: a process that locks the old one afterwards finds
    /// the part.
    pub fn finish(&self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// False if the folder has no locks, so that runs on it cannot detect each other. The folder of claims must exist.
pub fn locks(folder: &Folder) -> bool {
    Claim::work(folder)
}

/// Number of tasks that running processes have claimed.
pub fn count(folder: &Folder) -> usize {
    let Ok(entries) = fs::read_dir(folder.claims()) else { return 0 };
    let held = |path: PathBuf| {
        let file = File::open(path).ok();
        file.is_some_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    };
    entries.flatten().filter(|entry| held(entry.path())).count()
}
