//! Files that are written completely or not at all, whatever happens to the process or the machine: written under another name, flushed to
//! the disk, then renamed.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// Ending of files that are still being written.
pub const TEMPORARY: &str = "tmp";

/// A temporary file not written to for this long is a leftover: writing one takes seconds.
pub const LEFT_OVER: Duration = Duration::from_secs(3600);

/// A file that is being written; it takes its place when it is finished.
#[derive(Debug)]
pub struct Whole {
    path: PathBuf,
    /// Its temporary path; none for a special file, such as `/dev/stdout`. A lock marks it as in use.
    temporary: Option<PathBuf>,
    file: File,
}

impl Whole {
    /// Begins a file. Fails when it cannot be created.
    pub fn create(path: &Path) -> io::Result<Whole> {
        if path.exists() && !path.is_file() {
            return Ok(Whole { path: path.to_owned(), temporary: None, file: File::options().write(true).open(path)? });
        }
        loop {
            let temporary = path.with_extension(unique());
            let file = File::create_new(&temporary)?;
            // If files cannot be locked, `clean` decides by their age.
            let _ = file.lock();
            // Before the lock, `clean` may have removed it as a leftover.
            if temporary.exists() {
                return Ok(Whole { path: path.to_owned(), temporary: Some(temporary), file });
            }
        }
    }

    /// Puts the file in its place. Fails when it cannot be written to the disk; then nothing of it remains.
    pub fn finish(mut self) -> io::Result<()> {
        let Some(temporary) = &self.temporary else { return self.file.flush() };
        self.file.sync_all()?;
        fs::rename(temporary, &self.path)?;
        self.temporary = None;
        // The name is safe once the folder is. Some file systems cannot flush folders; then a power failure may bring the old file back.
        if let Ok(folder) = File::open(folder_of(&self.path)) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

impl Write for Whole {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for Whole {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            // Best effort: the error that led here matters more.
            let _ = fs::remove_file(temporary);
        }
    }
}

/// Writes a file. Fails when it cannot be written; then nothing of it remains.
pub fn write(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = Whole::create(path)?;
    file.write_all(content)?;
    file.finish()
}

/// Removes leftovers of killed processes beside a file that they were writing.
pub fn clean(path: &Path) {
    let Some(stem) = path.file_stem().and_then(|stem| stem.to_str()) else { return };
    for entry in fs::read_dir(folder_of(path)).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(|name| is_temporary_of(name, stem)) && is_left_over(&entry.path()) {
            // Best effort: a leftover does no harm.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// True if no process writes to a temporary file.
fn is_left_over(temporary: &Path) -> bool {
    let Ok(file) = File::options().write(true).open(temporary) else { return false };
    match file.try_lock() {
        Ok(()) => true,
        Err(TryLockError::WouldBlock) => false,
        Err(TryLockError::Error(_)) => file.metadata().is_ok_and(|file| is_old(&file)),
    }
}

/// True if a file has not been written to for so long that no process can still be writing it.
pub fn is_old(file: &fs::Metadata) -> bool {
    file.modified().is_ok_and(|written| written.elapsed().is_ok_and(|age| age > LEFT_OVER))
}

/// An extension that no other writer uses. In containers processes of several machines have the same number; hardly any two began to
/// write in the same nanosecond.
fn unique() -> String {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    static BEGAN: LazyLock<u128> =
        LazyLock::new(|| SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_nanos());
    let number = COUNTER.fetch_add(1, Ordering::Relaxed);
    format!("{}-{:x}-{number}.{TEMPORARY}", std::process::id(), *BEGAN)
}

/// True for `STEM.` and a suffix of [`unique`]; files of users may end in `.tmp`, too.
fn is_temporary_of(name: &str, stem: &str) -> bool {
    let middle = name.strip_prefix(stem).and_then(|rest| rest.strip_prefix('.')?.strip_suffix(".tmp"));
    let parts: Vec<&str> = middle.map_or(Vec::new(), |middle| middle.split('-').collect());
    let is_number = |part: &&str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_hexdigit());
    parts.len() == 3 && parts.iter().all(is_number)
}

fn folder_of(path: &Path) -> &Path {
    // `parent` of a bare name is an empty path and not a folder.
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_a_dead_process_left_of_this_file_is_removed() {
        let folder = std::env::temp_dir().join(format!("leadlag-whole-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("room");
        let page = folder.join("page.html");
        let others = ["page.tmp", "page.old.tmp", "page.1-2.tmp", "other.12-ab-0.tmp", "page.12-ab-0.html"];
        for name in others.iter().chain(&["page.12-18af-0.tmp"]) {
            fs::write(folder.join(name), "half").expect("room");
        }
        let mut written = Whole::create(&page).expect("room");
        written.write_all(b"whole").expect("room");
        clean(&page);
        let left = || fs::read_dir(&folder).expect("it is there").count();
        assert_eq!(left(), others.len() + 1, "the others and the one that is being written");
        assert!(others.iter().all(|name| folder.join(name).exists()) && !page.exists());
        written.finish().expect("room");
        assert_eq!(fs::read(&page).expect("it is there"), b"whole");
        drop(Whole::create(&page).expect("room"));
        assert_eq!(left(), others.len() + 1, "an unfinished file leaves nothing behind");
        assert_eq!(fs::read(&page).expect("it is there"), b"whole");
        fs::remove_dir_all(&folder).expect("it is ours");
    }
}
