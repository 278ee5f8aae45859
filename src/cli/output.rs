//! Writing to stdout and to files.

use crate::whole::{self, Whole};
use anyhow::Context;
use std::cell::RefCell;
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

static QUIET: AtomicBool = AtomicBool::new(false);

/// `--quiet`: nothing but errors goes to stderr from now on.
pub fn set_quiet(quiet: bool) {
    // A verb that runs others (demo) must not reset `--quiet`.
    QUIET.fetch_or(quiet, Ordering::Relaxed);
}

/// True if progress, hints and warnings are not wanted.
pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

thread_local! {
    /// Takes the results of a command that runs within another one.
    static CAPTURED: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Runs a command and returns its output.
pub fn captured(run: impl FnOnce() -> anyhow::Result<()>) -> anyhow::Result<String> {
    CAPTURED.set(Some(String::new()));
    let done = run();
    let text = CAPTURED.take().unwrap_or_default();
    done.map(|()| text)
}

/// Prints a result to stdout; characters that could move a cursor become escapes, which are valid in JSON, too.
pub fn print(text: &str) -> anyhow::Result<()> {
    print_as_is(&crate::text::shown::lines(text))
}

/// Prints text without foreign content.
pub fn print_as_is(text: &str) -> anyhow::Result<()> {
    if CAPTURED.with_borrow_mut(|captured| captured.as_mut().map(|all| all.push_str(text)).is_some()) {
        return Ok(());
    }
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).context("stdout: cannot write the result")
}

/// Stdout for a table, whose bytes stay unchanged; only a terminal is shown escapes in their place.
pub fn table() -> Box<dyn Write> {
    let stdout = std::io::stdout();
    if stdout.is_terminal() { Box::new(Shown { inner: stdout, line: Vec::new() }) } else { Box::new(stdout) }
}

/// Replaces characters that could move a cursor by escapes, line by line.
struct Shown<W> {
    inner: W,
    /// The part of a line that has not ended.
    line: Vec<u8>,
}

impl<W: Write> Write for Shown<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        for piece in bytes.split_inclusive(|byte| *byte == b'\n') {
            self.line.extend(piece);
            if piece.ends_with(b"\n") {
                let line = std::mem::take(&mut self.line);
                self.inner.write_all(crate::text::shown::lines(&String::from_utf8_lossy(&line)).as_bytes())?;
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.inner.flush()
    }
}

/// Warns that a spreadsheet would run a text of a table as a formula; programs read it as text.
pub fn warn_of_formula(file: &Path, table: &crate::study::table::Table) {
    if let Some(text) = crate::report::csv::formula(table) {
        let (file, clipped) = (file.display(), text.chars().take(40).collect::<String>());
        super::evaluator::warn(&format!(
            "{file}: the text {clipped:?} begins like a formula, which a spreadsheet that opens the file would run; import the columns as text"
        ));
    }
}

/// Prints a value as JSON to stdout.
pub fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    print(&(serde_json::to_string_pretty(value)? + "\n"))
}

/// Starts a file that takes its place when it is finished; leftovers of killed processes are removed.
pub fn begin_file(path: &Path) -> anyhow::Result<Whole> {
    whole::clean(path);
    Whole::create(path).with_context(|| format!("{}: cannot write the file", path.display()))
}

/// Puts a file in its place.
pub fn finish_file(file: Whole, path: &Path) -> anyhow::Result<()> {
    file.finish().with_context(|| format!("{}: cannot write the file", path.display()))
}

/// Writes a file completely, or leaves the old one.
pub fn write_file(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    let mut file = begin_file(path)?;
    file.write_all(content).with_context(|| format!("{}: cannot write the file", path.display()))?;
    finish_file(file, path)
}

/// Makes a folder with its parents.
pub fn make_folder(path: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(path).with_context(|| format!("{}: cannot make the folder", path.display()))
}

/// An error in writing a table, with its path.
pub fn write_error(source: csv::Error, path: Option<&Path>) -> anyhow::Error {
    let place = path.map_or("stdout".to_owned(), |p| p.display().to_string());
    anyhow::Error::new(source).context(format!("{place}: cannot write the results"))
}

/// True if the reader of stdout has closed it (`| head`), which is not a failure.
pub fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let io = cause.downcast_ref::<std::io::Error>().map(std::io::Error::kind);
        let csv = cause.downcast_ref::<csv::Error>().and_then(|e| match e.kind() {
            csv::ErrorKind::Io(e) => Some(e.kind()),
            _ => None,
        });
        io.or(csv) == Some(ErrorKind::BrokenPipe)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_is_shown_escapes() {
        let mut shown = Shown { inner: Vec::new(), line: Vec::new() };
        for piece in ["a\tn", "o\u{1b}[2J\n\u{e9}", "t\u{9b}\n"] {
            shown.write_all(piece.as_bytes()).expect("room");
        }
        shown.flush().expect("room");
        assert_eq!(String::from_utf8(shown.inner).expect("UTF-8"), "a\tno\\u001b[2J\n\u{e9}t\\u009b\n");
    }
}
