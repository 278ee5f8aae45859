//! The bar of a running diagnosis, after a second; without a terminal, one line a minute.

use super::super::lines::Lines;
use super::super::{interrupt, output};
use crate::diagnose::Progress;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Steps of the bar.
const STEPS: u64 = 1000;

pub struct Bar {
    bar: ProgressBar,
    lines: Lines,
    started: Instant,
}

impl Bar {
    pub fn new() -> Bar {
        let style = ProgressStyle::with_template("{bar:30} {percent:>3} % {elapsed}  {msg}");
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::hidden())
            .with_style(style.expect("the template is valid"));
        Bar { bar, lines: Lines::new(), started: Instant::now() }
    }

    /// Shows the progress; breaks after Ctrl-C.
    pub fn update(&mut self, progress: &Progress) -> ControlFlow<()> {
        if !output::is_quiet() && self.bar.is_hidden() && self.started.elapsed() > Duration::from_secs(1) {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_position((progress.done * STEPS as f64) as u64);
        self.bar.set_message(progress.stage.clone());
        self.lines.tell(|| {
            format!("{:.0} %, {:#}  {}", 100.0 * progress.done, HumanDuration(self.bar.elapsed()), progress.stage)
        });
        if interrupt::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
