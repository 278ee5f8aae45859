//! The bar of a running calibration, after two seconds; without a terminal, one line a minute.

use super::super::lines::Lines;
use super::super::{interrupt, output};
use crate::calibrate::{Calibration, Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Whole numbers per second.
pub fn rate(state: &ProgressState, out: &mut dyn Write) {
    // A closed terminal must not end a calibration.
    let _ = write!(out, "{:.0}/s", state.per_sec());
}

pub struct Bar {
    bar: ProgressBar,
    lines: Lines,
    started: Instant,
    /// Evaluations of each replicate, which advance together.
    evaluations: Vec<u64>,
    best: Option<f64>,
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
        let evaluations = vec![0; settings.replicates as usize];
        Bar { bar, lines: Lines::new(), started: Instant::now(), evaluations, best: None }
    }

    /// Shows the progress of the search; breaks after Ctrl-C.
    pub fn update(&mut self, progress: Progress) -> ControlFlow<()> {
        if !output::is_quiet() && self.bar.is_hidden() && self.started.elapsed() > Duration::from_secs(2) {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.evaluations[progress.replicate as usize] = progress.evaluations;
        self.best = self.best.into_iter().chain(progress.best).reduce(f64::min);
        self.bar.set_position(self.evaluations.iter().sum());
        let best = self.best.map_or("no feasible candidate yet".to_owned(), |b| format!("best {b:.6}"));
        let of = match self.evaluations.len() {
            1 => String::new(),
            replicates => format!("{replicates} replicates, "),
        };
        let (done, whole) = (self.bar.position(), self.bar.length().unwrap_or(0));
        self.lines.tell(|| format!("{done}/{whole} evaluations, {of}{best}"));
        self.bar.set_message(format!("{of}{best}"));
        if interrupt::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
