//! Progress without a bar: a plain line from time to time, for the log of an unattended run.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Seconds between two lines.
const VARIABLE: &str = "LEADLAG_PROGRESS_S";

/// Often enough to show progress, seldom enough that a day fits a screen or two.
const EVERY: Duration = Duration::from_secs(60);

/// The lines of one command; none if stderr is a terminal, which has the bar, or with `--quiet`.
pub struct Lines {
    every: Option<Duration>,
    last: Instant,
}

impl Lines {
    pub fn new() -> Lines {
        let asked = std::env::var(VARIABLE).ok().and_then(|text| text.parse().ok());
        let every = asked.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()).unwrap_or(EVERY);
        Lines { every: (!std::io::stderr().is_terminal()).then_some(every), last: Instant::now() }
    }

    /// Prints a line if it is time for one.
    pub fn tell(&mut self, line: impl FnOnce() -> String) {
        if self.every.is_some_and(|every| self.last.elapsed() >= every) {
            self.last = Instant::now();
            eprintln!("{}", line());
        }
    }
}
