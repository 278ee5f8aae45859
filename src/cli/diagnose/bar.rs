//! The bar of a running diagnosis.

use super::super::interrupt::go_on;
use super::super::progress;
use crate::diagnose::Progress;
use indicatif::HumanDuration;
use std::ops::ControlFlow;
use std::time::Duration;

/// Steps of the bar.
const STEPS: u64 = 1000;

pub struct Bar(progress::Bar);

impl Bar {
    pub fn new() -> Bar {
        Bar(progress::Bar::new("{bar:30} {percent:>3} % {elapsed}  {msg}", Some(STEPS), Duration::from_secs(1)))
    }

    /// Shows the progress; breaks after Ctrl-C.
    pub fn update(&mut self, Progress { done, stage }: &Progress) -> ControlFlow<()> {
        self.0.show((done * STEPS as f64) as u64, stage.clone(), |bar| {
            format!("{:.0} %, {:#}  {stage}", 100.0 * done, HumanDuration(bar.elapsed()))
        });
        go_on()
    }

    pub fn finish(&self) {
        self.0.finish();
    }
}
