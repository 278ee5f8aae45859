//! Whether measured signals can be those of two cars on a road: one place, which every verb asks.
//!
//! Nothing is refused here. Each check gives sentences with times, sizes and what to do; where nothing can be computed, reading and preparation
//! refuse.

mod clock;
mod held;
mod jumps;
mod noise;
mod ratio;
mod speeds;

pub use clock::of_time;

use super::agreement::gap_column;
use super::{Layout, Trajectory};

/// The signals of a follower and the car ahead, on one time axis; missing values are NaN.
#[derive(Debug, Clone, Copy)]
pub(super) struct Signals<'a> {
    /// Time \[s\].
    pub t: &'a [f64],
    /// Speed of the car ahead \[m/s\].
    pub v_l: &'a [f64],
    /// Speed of the follower \[m/s\].
    pub v_f: &'a [f64],
    /// Gap \[m\].
    pub gap: &'a [f64],
    /// What the gap is called.
    pub called: &'a str,
}

impl Signals<'_> {
    /// Distance that the difference of the speeds tells, up to each sample \[m\]; NaN from where a speed is missing on until the next sample.
    fn told(&self) -> Vec<f64> {
        let dv = |i: usize| self.v_l[i] - self.v_f[i];
        let mut told = Vec::with_capacity(self.t.len());
        let mut sum = 0.0;
        for i in 0..self.t.len() {
            if i > 0 {
                let step = 0.5 * (dv(i - 1) + dv(i)) * (self.t[i] - self.t[i - 1]);
                sum += if step.is_finite() { step } else { 0.0 };
            }
            told.push(if dv(i).is_finite() { sum } else { f64::NAN });
        }
        told
    }
}

/// What is wrong with the signals of one link; `is_scaled` where a unit is known to be wrong, which explains the rest.
pub(super) fn of_signals(signals: &Signals, is_scaled: bool) -> Vec<String> {
    let mut said = speeds::said(signals);
    if !is_scaled {
        said.extend(ratio::said(signals));
        said.extend(jumps::said(signals));
        said.extend(held::said(signals));
    }
    said
}

/// What is wrong with a trajectory that is about to be used, besides what its notes say.
#[must_use]
pub fn of_trajectory(trajectory: &Trajectory, layout: Layout) -> Vec<String> {
    let Trajectory { t, v_l, v_f, s, notes, .. } = trajectory;
    let called = gap_column(trajectory.follower + 1, layout);
    let is_scaled = notes.iter().any(|note| matches!(note, super::Note::UnitsContradict { .. }));
    let mut said = of_signals(&Signals { t, v_l, v_f, gap: s, called: &called }, is_scaled);
    said.extend(of_acceleration(v_f, trajectory.dt));
    said
}

/// That the accelerations of a follower with speeds `v` every `dt` \[s\] are mostly noise.
pub(super) fn of_acceleration(v: &[f64], dt: f64) -> Option<String> {
    noise::said(v, dt)
}

#[cfg(test)]
mod tests;
