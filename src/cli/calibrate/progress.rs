//! The bar of a running calibration.

use super::super::interrupt::go_on;
use super::super::progress;
use crate::calibrate::{Calibration, Progress};
use std::ops::ControlFlow;
use std::time::Duration;

pub struct Bar {
    bar: progress::Bar,
    /// Evaluations of each replicate, which advance together.
    evaluations: Vec<u64>,
    best: Option<f64>,
}

impl Bar {
    pub fn new(settings: &Calibration) -> Bar {
        let all = settings.stop.max_evaluations.saturating_mul(settings.replicates);
        let template = "{bar:20} {human_pos}/{human_len} {rate} {eta} left  {msg}";
        let evaluations = vec![0; settings.replicates as usize];
        Bar { bar: progress::Bar::new(template, Some(all), Duration::from_secs(2)), evaluations, best: None }
    }

    /// Shows the progress of the search; breaks after Ctrl-C.
    pub fn update(&mut self, progress: Progress) -> ControlFlow<()> {
        let own = &mut self.evaluations[progress.replicate as usize];
        // Fewer than before: another search began, as that of a fold, and its scores are others.
        if progress.evaluations < *own {
            self.best = None;
        }
        *own = progress.evaluations;
        self.best = self.best.into_iter().chain(progress.best).reduce(f64::min);
        let best = self.best.map_or("no feasible candidate yet".to_owned(), |b| format!("best {b:.6}"));
        let message = match self.evaluations.len() {
            1 => best,
            replicates => format!("{replicates} replicates, {best}"),
        };
        self.bar.show(self.evaluations.iter().sum(), message, |bar| {
            format!("{}/{} evaluations, {}", bar.position(), bar.length().unwrap_or(0), bar.message())
        });
        go_on()
    }

    pub fn finish(&self) {
        self.bar.finish();
    }
}
