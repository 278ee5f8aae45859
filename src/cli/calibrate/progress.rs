//! The bar of a running calibration: on a terminal only, and only after two seconds.

use super::super::interrupt;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use leadlag::calibrate::{Calibration, Progress};
use std::fmt::Write;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Whole numbers per second.
pub fn rate(state: &ProgressState, out: &mut dyn Write) {
    // A text that cannot be shown is no reason to end a calibration.
    let _ = write!(out, "{:.0}/s", state.per_sec());
}

pub struct Bar {
    bar: ProgressBar,
    started: Instant,
    per_replicate: u64,
    replicates: u64,
}

impl Bar {
    pub fn new(settings: &Calibration) -> Bar {
        let per_replicate = settings.stop.max_evaluations;
        let style = ProgressStyle::with_template("{bar:20} {human_pos}/{human_len} {rate} {eta} left  {msg}");
        let bar = ProgressBar::with_draw_target(
            Some(per_replicate.saturating_mul(settings.replicates)),
            ProgressDrawTarget::hidden(),
        )
        .with_style(style.expect("the template is valid").with_key("rate", rate));
        Bar { bar, started: Instant::now(), per_replicate, replicates: settings.replicates }
    }

    /// Shows where the search is; breaks once Ctrl-C was pressed.
    pub fn update(&mut self, progress: Progress) -> ControlFlow<()> {
        if self.bar.is_hidden() && self.started.elapsed() > Duration::from_secs(2) {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_position(progress.replicate * self.per_replicate + progress.evaluations);
        let best = progress.best.map_or("no feasible candidate yet".to_owned(), |b| format!("best {b:.6}"));
        self.bar.set_message(format!("replicate {} of {}, {best}", progress.replicate + 1, self.replicates));
        if interrupt::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
