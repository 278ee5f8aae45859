//! Periodic effects. The likelihood has almost no slope in a frequency, so starts are peaks in the spectrum of the missing acceleration.

use super::scan::highest;
use super::{Scope, Search, Stop, Task, Values};
use crate::diagnose::drive::Drive;
use rayon::prelude::*;

/// The lowest and the highest frequency \[Hz\].
const RANGE: (f64, f64) = (0.005, 1.5);
/// Start value of each amplitude \[m/s²\].
const AMPLITUDE: f64 = 0.02;

/// See [`Search`].
pub struct Harmonic;

impl Search for Harmonic {
    fn starts(&self, task: &Task<'_>) -> Result<Vec<Scope>, Stop> {
        let model = task.model(None)?;
        let at = |f: f64| -> Values {
            let of = |&k: &usize| match model.symbols[k].neutral() {
                Some(_) => Some((k, AMPLITUDE)),
                None => (model.symbols[k].unit() == "Hz").then_some((k, f)),
            };
            model.positions(task.cause).iter().filter_map(of).collect()
        };
        let found = peaks(task.setting.question.train, task.missing, task.budget.hints);
        let sizes: Vec<Values> = found.into_iter().map(at).collect();
        Ok(vec![task.scope(model, &sizes, Vec::new())])
    }
}

/// Frequencies \[Hz\] at which the missing acceleration has the most power relative to neighbouring frequencies.
fn peaks(drives: &[Drive], missing: &[Vec<f64>], most: usize) -> Vec<f64> {
    let longest = drives.iter().map(|d| d.samples() as f64 * d.dt()).fold(1.0, f64::max);
    let step = 0.5 / longest;
    let count = ((RANGE.1 - RANGE.0) / step) as usize;
    let power = |i: usize| -> f64 {
        let f = RANGE.0 + i as f64 * step;
        let sum = |(drive, d): (&Drive, &Vec<f64>)| {
            // Rotation instead of a sine and cosine per sample.
            let (turn_s, turn_c) = (std::f64::consts::TAU * f * drive.dt()).sin_cos();
            let (mut s, mut c, mut sine, mut cosine) = (0.0, 1.0, 0.0, 0.0);
            for d in d {
                sine += s * d;
                cosine += c * d;
                (s, c) = (s * turn_c + c * turn_s, c * turn_c - s * turn_s);
            }
            sine * sine + cosine * cosine
        };
        drives.iter().zip(missing).map(sum).sum()
    };
    let spectrum: Vec<f64> = (0..count).into_par_iter().map(power).collect();
    let contrast = |i: usize| {
        let around = &spectrum[i.saturating_sub(40)..(i + 40).min(count)];
        spectrum[i] / (around.iter().sum::<f64>() / around.len() as f64).max(f64::MIN_POSITIVE)
    };
    let contrasts: Vec<f64> = (0..count).map(contrast).collect();
    highest(&contrasts, 5, most).into_iter().map(|i| RANGE.0 + i as f64 * step).collect()
}
