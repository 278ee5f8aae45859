//! Folders of results that change as a whole: a reader sees files of one result only, at any moment.
//!
//! ```text
//!  NEW/      files are written here; if the process is killed meanwhile, nothing has changed
//!  READY/    NEW renamed, in one step: from here on the change is complete; the next process finishes it if necessary
//!  the old files are removed, then the new ones moved into their places: an old one never lies beside a new one
//! ```
//!
//! Commands that change one folder wait for each other by a lock on it. If folders cannot be locked, two that change one at the same time
//! may mix their files. A reader holds no lock: files that it opens before and after a change belong to two results.

use super::output;
use crate::text::bounded;
use anyhow::{Context, bail, ensure};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Component, Path, PathBuf};
use std::time::{Duration, Instant};

const NEW: &str = ".leadlag-new";
const READY: &str = ".leadlag-ready";
/// In `READY`: one name per line, after `- ` files to remove, after `+ ` files to put in place, in this order.
const LIST: &str = ".list";
/// Longest time to rename the files of a folder, unless the process was killed: milliseconds on a disk, a second or two over a network.
const PATIENCE: Duration = Duration::from_secs(10);

/// New files of a folder, none of which is in its place yet.
#[derive(Debug)]
pub struct Change {
    folder: PathBuf,
    names: Vec<String>,
    /// Keeps others from changing the same folder, if the system can lock one.
    _lock: Option<File>,
}

impl Change {
    /// Begins a change of a folder, which is created if missing; waits for other processes that change it.
    pub fn begin(folder: &Path) -> anyhow::Result<Change> {
        output::make_folder(folder)?;
        let lock = locked(folder);
        clear(folder, lock.as_ref())?;
        output::make_folder(&folder.join(NEW))?;
        Ok(Change { folder: folder.to_owned(), names: Vec::new(), _lock: lock })
    }

    /// Writes a file; readers see it once the change is finished. The last one marks the kind of the result.
    pub fn write(&mut self, name: &str, content: &[u8]) -> anyhow::Result<()> {
        fs::write(self.new_files().join(name), content)
            .with_context(|| format!("{}: cannot write the file", self.folder.join(name).display()))?;
        self.take(name)
    }

    /// The folder of the new files, for another program that writes some of them.
    pub fn new_files(&self) -> PathBuf {
        self.folder.join(NEW)
    }

    /// Includes an existing file in the new ones.
    pub fn take(&mut self, name: &str) -> anyhow::Result<()> {
        let place = self.folder.join(name);
        ensure!(!place.is_dir(), "{}: cannot write the file because a folder has this name", place.display());
        let written = File::options().append(true).open(self.new_files().join(name)).and_then(|file| file.sync_all());
        written.with_context(|| format!("{}: cannot write the file", place.display()))?;
        self.names.push(name.to_owned());
        Ok(())
    }

    /// Puts the new files in place. Removes the files of `before` that the new result lacks, and returns their names.
    pub fn finish(self, before: Vec<String>) -> anyhow::Result<Vec<String>> {
        let is_stale = |name: &String| !self.names.contains(name) && self.folder.join(name).is_file();
        let stale: Vec<String> = BTreeSet::from_iter(before).into_iter().filter(is_stale).collect();
        let removed = stale.iter().map(|name| format!("- {name}\n"));
        let list: String = removed.chain(self.names.iter().map(|name| format!("+ {name}\n"))).collect();
        let (new, ready) = (self.new_files(), self.folder.join(READY));
        flushed(&new.join(LIST), list.as_bytes())
            .and_then(|()| fs::rename(&new, &ready))
            .with_context(|| format!("{}: cannot change the folder", self.folder.display()))?;
        make(&self.folder)?;
        Ok(stale)
    }
}

impl Drop for Change {
    fn drop(&mut self) {
        // Removed if it was finished; otherwise nothing has changed.
        let _ = fs::remove_dir_all(self.new_files());
    }
}

/// Completes a change that a killed process has left unfinished. Every reader of a folder of results calls this first.
pub fn settle(folder: &Path) -> anyhow::Result<()> {
    // Result of `parent` for a bare name.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if folder.join(READY).exists() { complete(folder, locked(folder).as_ref()) } else { Ok(()) }
}

/// Completes a change that no process is making now: the holder of the lock can be sure of that; a process without the lock waits.
fn complete(folder: &Path, lock: Option<&File>) -> anyhow::Result<()> {
    let began = Instant::now();
    while lock.is_none() && folder.join(READY).exists() && began.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(50));
    }
    make(folder)
}

/// Completes a change that was ready, and removes files of one that was not.
fn clear(folder: &Path, lock: Option<&File>) -> anyhow::Result<()> {
    complete(folder, lock)?;
    ignoring_absence(fs::remove_dir_all(folder.join(NEW))).with_context(|| {
        format!("{}: cannot remove the files that a killed process has left", folder.join(NEW).display())
    })
}

/// Makes the change that is ready, or the rest of it.
fn make(folder: &Path) -> anyhow::Result<()> {
    let ready = folder.join(READY);
    let list = match bounded::read_to_string(&ready.join(LIST), bounded::TEXT_MAX) {
        Ok(list) => list,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            // Remove the list last: then the change is complete, and a process without the right to remove the folder can still read.
            let _ = fs::remove_dir_all(&ready);
            return Ok(());
        }
        Err(error) => return Err(error).with_context(|| format!("{}: cannot read the change", ready.display())),
    };
    let named = |sign: &str| list.lines().filter_map(|line| line.strip_prefix(sign)).collect::<Vec<_>>();
    // Another user may have made the folder, and must not gain access to files beside it.
    if let Some(name) = named("+ ").into_iter().chain(named("- ")).find(|name| !is_plain(name)) {
        bail!("{}: expected names of files in this folder, found {name:?}; remove the folder", ready.display());
    }
    // Files that have been moved already are new.
    let waiting: Vec<&str> = named("+ ").into_iter().filter(|name| ready.join(name).exists()).collect();
    let done = || {
        for name in named("- ").iter().chain(&waiting) {
            ignoring_absence(fs::remove_file(folder.join(name)))?;
        }
        for name in &waiting {
            fs::rename(ready.join(name), folder.join(name))?;
        }
        if let Ok(folder) = File::open(folder) {
            // Some file systems cannot do this; a power failure may then lose the names.
            let _ = folder.sync_all();
        }
        fs::remove_file(ready.join(LIST))?;
        fs::remove_dir_all(&ready)
    };
    done().with_context(|| format!("{}: cannot put the new files in their places", folder.display()))
}

/// True for the name of a file without a path.
fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    matches!(parts.next(), Some(Component::Normal(_))) && parts.next().is_none()
}

fn flushed(path: &Path, content: &[u8]) -> std::io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(content)?;
    file.sync_all()
}

fn ignoring_absence(done: std::io::Result<()>) -> std::io::Result<()> {
    done.or_else(|error| if error.kind() == ErrorKind::NotFound { Ok(()) } else { Err(error) })
}

/// The folder, locked until the file is closed; none if folders cannot be locked.
fn locked(folder: &Path) -> Option<File> {
    let file = File::open(folder).ok()?;
    file.lock().ok()?;
    Some(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn files(folder: &Path) -> BTreeMap<String, String> {
        let entries = fs::read_dir(folder).expect("it is there").flatten();
        let visible = entries.filter(|entry| entry.path().is_file());
        visible
            .map(|entry| {
                let content = fs::read_to_string(entry.path()).expect("text");
                (entry.file_name().into_string().expect("UTF-8"), content)
            })
            .collect()
    }

    fn result(names: &[&str], content: &str) -> BTreeMap<String, String> {
        names.iter().map(|name| ((*name).to_owned(), content.to_owned())).collect()
    }

    fn write(change: &mut Change, names: &[&str], content: &str) {
        names.iter().for_each(|name| change.write(name, content.as_bytes()).expect("room"));
    }

    /// Wherever a process was killed, the next one completes the change and leaves nothing behind.
    #[test]
    fn a_change_is_completed_from_wherever_it_stopped() {
        for moved in 0..4 {
            let folder = tempfile::tempdir().expect("room");
            let folder = folder.path();
            let mut change = Change::begin(folder).expect("it is free");
            write(&mut change, &["a", "b", "c", "old"], "1");
            assert_eq!(files(folder), result(&[], ""));
            change.finish(Vec::new()).expect("room");
            fs::create_dir(folder.join(READY)).expect("room");
            fs::write(folder.join(READY).join(LIST), "- old\n+ a\n+ b\n+ c\n").expect("room");
            for (k, name) in ["a", "b", "c"].iter().enumerate() {
                let place = if k < moved { folder.to_owned() } else { folder.join(READY) };
                fs::write(place.join(name), "2").expect("room");
            }
            settle(folder).expect("it can be completed");
            assert_eq!(files(folder), result(&["a", "b", "c"], "2"), "{moved} were in their places");
            assert_eq!(fs::read_dir(folder).expect("it is there").count(), 3);
        }
    }

    /// Two at once would each remove the new files of the other.
    #[test]
    fn without_a_lock_a_change_is_left_to_who_makes_it() {
        let folder = tempfile::tempdir().expect("room");
        let folder = folder.path();
        fs::create_dir(folder.join(READY)).expect("room");
        fs::write(folder.join(READY).join(LIST), "+ a\n").expect("room");
        fs::write(folder.join(READY).join("a"), "2").expect("room");
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(200));
                assert!(folder.join(READY).join("a").exists(), "a reader has meddled");
                make(folder).expect("no other change");
            });
            complete(folder, None).expect("it was made");
        });
        assert_eq!(files(folder), result(&["a"], "2"));
    }

    #[test]
    fn a_list_of_somebody_else_reaches_nothing_outside() {
        for name in ["../victim", "/etc/hostname", "a/../../victim", ".."] {
            for sign in ["+", "-"] {
                let outside = tempfile::tempdir().expect("room");
                let folder = outside.path().join("result");
                fs::create_dir_all(folder.join(READY)).expect("room");
                fs::write(outside.path().join("victim"), "kept").expect("room");
                fs::write(folder.join(READY).join(LIST), format!("{sign} {name}\n")).expect("room");
                let error = settle(&folder).expect_err(name).to_string();
                assert!(error.contains("expected names of files in this folder"), "{error}");
                assert_eq!(fs::read_to_string(outside.path().join("victim")).expect("untouched"), "kept");
            }
        }
    }

    #[test]
    fn what_is_given_up_or_killed_early_changes_nothing() {
        let folder = tempfile::tempdir().expect("room");
        let folder = folder.path();
        let mut change = Change::begin(folder).expect("it is free");
        write(&mut change, &["a", "b"], "1");
        change.finish(Vec::new()).expect("room");
        let mut change = Change::begin(folder).expect("it is free");
        write(&mut change, &["a"], "2");
        drop(change);
        assert_eq!(files(folder), result(&["a", "b"], "1"));
        // A killed process drops nothing.
        fs::create_dir(folder.join(NEW)).expect("room");
        fs::write(folder.join(NEW).join("a"), "2").expect("room");
        settle(folder).expect("nothing to do");
        assert_eq!(files(folder), result(&["a", "b"], "1"));
        let mut change = Change::begin(folder).expect("it is free");
        write(&mut change, &["a"], "3");
        assert_eq!(change.finish(vec!["b".to_owned(), "none".to_owned()]).expect("room"), ["b"]);
        assert_eq!(files(folder), result(&["a"], "3"));
        fs::create_dir(folder.join("d")).expect("room");
        let mut change = Change::begin(folder).expect("it is free");
        let error = change.write("d", b"").expect_err("a folder").to_string();
        assert!(error.contains("a folder has this name"), "{error}");
    }
}
