//! Effort and results of a replicate, and the criterion to stop.

use super::descent::Watch;
use crate::calibrate::search::fall_to;
use crate::calibrate::{Calibration, Progress, StopReason};
use std::ops::ControlFlow;
use std::time::Instant;

/// Evaluations reserved for the exact scores of the points of a search when it is stopped.
pub const LAST: usize = 16;

/// The record of a replicate.
pub struct Record<'a> {
    pub settings: &'a Calibration,
    pub number: u64,
    started: Instant,
    progress: &'a (dyn Fn(Progress) -> ControlFlow<()> + Sync),
    pub evaluations: u64,
    /// Requests for simulations since the best score was found.
    stall: u64,
    /// Best point by the exact objective, and its score.
    pub best: Option<(Vec<f64>, f64)>,
    pub convergence: Vec<(u64, f64)>,
    pub near: Vec<(f64, Vec<f64>)>,
    pub stopped: Option<StopReason>,
}

impl<'a> Record<'a> {
    pub fn new(
        settings: &'a Calibration,
        number: u64,
        progress: &'a (dyn Fn(Progress) -> ControlFlow<()> + Sync),
    ) -> Record<'a> {
        Record {
            settings,
            number,
            started: Instant::now(),
            progress,
            evaluations: 0,
            stall: 0,
            best: None,
            convergence: Vec::new(),
            near: Vec::new(),
            stopped: None,
        }
    }

    /// Keeps a candidate and its exact score.
    pub fn keep(&mut self, place: Vec<f64>, candidate: Vec<f64>, score: f64) {
        self.near.push((score, candidate));
        if self.best.as_ref().is_none_or(|(_, best)| score < *best) {
            self.stall = 0;
            self.best = Some((place, score));
            fall_to(&mut self.convergence, self.evaluations, score);
        }
    }

    /// The reason why no more simulations are allowed, if any.
    fn refusal(&self, simulations: u64) -> Option<StopReason> {
        let stop = &self.settings.stop;
        let best = self.best.as_ref().map(|(_, score)| *score);
        let told = Progress { replicate: self.number, evaluations: self.evaluations, best };
        if (self.progress)(told).is_break() {
            Some(StopReason::Interrupted)
        } else if self.evaluations + simulations + LAST as u64 > stop.max_evaluations {
            Some(StopReason::Evaluations)
        } else if self.stall >= stop.max_stall {
            Some(StopReason::Stall)
        } else {
            stop.max_time.filter(|limit| self.started.elapsed() >= *limit).map(|_| StopReason::Time)
        }
    }
}

impl Watch for Record<'_> {
    fn spend(&mut self, simulations: usize) -> bool {
        self.stopped = self.stopped.or_else(|| self.refusal(simulations as u64));
        if self.stopped.is_none() {
            self.evaluations += simulations as u64;
            self.stall += 1;
        }
        self.stopped.is_none()
    }
}
