//! The progress of a command: a bar on a terminal, elsewhere a plain line from time to time, for the log of an unattended run.

use super::output::is_quiet;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Seconds between two lines.
const VARIABLE: &str = "LEADLAG_PROGRESS_S";

/// Often enough to show progress, seldom enough that a day fits a screen or two.
const EVERY: Duration = Duration::from_secs(60);

/// A bar, or lines in its place. `--quiet` silences both.
pub struct Bar {
    /// The bar, which may be hidden.
    pub bar: ProgressBar,
    /// When it appears.
    after: Duration,
    started: Instant,
    /// Interval of lines; none if stderr is a terminal, which has the bar.
    every: Option<Duration>,
    last: Instant,
}

impl Bar {
    /// A bar of this form and length, if it is known, which appears after some time; `rate` there is a whole number per second.
    pub fn new(template: &str, length: Option<u64>, after: Duration) -> Bar {
        let style = ProgressStyle::with_template(template).expect("the template is valid").with_key("rate", rate);
        let bar = ProgressBar::with_draw_target(length, ProgressDrawTarget::hidden()).with_style(style);
        let asked = std::env::var(VARIABLE).ok().and_then(|text| text.parse().ok());
        let every = asked.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()).unwrap_or(EVERY);
        let every = (!std::io::stderr().is_terminal()).then_some(every);
        Bar { bar, after, started: Instant::now(), every, last: Instant::now() }
    }

    /// Shows the position with a message, or prints a line if it is time for one.
    pub fn show(&mut self, position: u64, message: String, line: impl FnOnce(&ProgressBar) -> String) {
        if !is_quiet() && self.bar.is_hidden() && self.started.elapsed() >= self.after {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_position(position);
        self.bar.set_message(message);
        if self.every.is_some_and(|every| self.last.elapsed() >= every) {
            self.last = Instant::now();
            eprintln!("{}", line(&self.bar));
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Whole numbers per second.
fn rate(state: &ProgressState, out: &mut dyn Write) {
    // A closed terminal must not end a calibration.
    let _ = write!(out, "{:.0}/s", state.per_sec());
}
