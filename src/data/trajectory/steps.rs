//! Steps of a signal that sums must not cross: a pause of the recording, a new lap, an id that another car takes over.

use super::prepare::{GRID_TOLERANCE_S, median_step};
use crate::statistics::order_statistic;
use std::ops::Range;

/// A step of time that is longer than this, and than the usual step by a factor, is a pause \[s\]: preparation does not interpolate it by
/// default.
pub(super) const PAUSE_S: f64 = 1.0;
/// That factor: a table with one row every two seconds has no pauses.
const UNUSUAL: f64 = 1.5;
/// A change of position of more than this multiple of the usual one is not driving: the end of a lap, or another car.
const JUMP: f64 = 5.0;
/// Share of the steps that do not exceed the usual change of position, so that the usual change is not that of a car that
/// mostly stands.
const USUAL: f64 = 0.9;

/// The longest step of time that is not a pause \[s\].
pub(super) fn longest_step(t: &[f64]) -> f64 {
    let usual = median_step(t).unwrap_or(PAUSE_S);
    PAUSE_S.max(UNUSUAL * usual) + GRID_TOLERANCE_S
}

/// The largest change of a position from one sample to the next by driving \[m\]; infinite without motion.
pub(super) fn largest_move(x: &[f64]) -> f64 {
    let moves = x.windows(2).map(|x| (x[1] - x[0]).abs()).filter(|step| step.is_finite());
    let usual = order_statistic(moves, USUAL).unwrap_or(0.0);
    if usual > 0.0 { JUMP * usual } else { f64::INFINITY }
}

/// Maximal ranges within `over` in which `holds` is true.
pub(super) fn runs(over: Range<usize>, holds: impl Fn(usize) -> bool) -> impl Iterator<Item = Range<usize>> {
    let mut next = over.start;
    std::iter::from_fn(move || {
        let start = (next..over.end).find(|&i| holds(i))?;
        let end = (start..over.end).find(|&i| !holds(i)).unwrap_or(over.end);
        next = end;
        Some(start..end)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_is_longer_than_usual_and_than_a_second() {
        let every = |dt: f64| (0..100).map(|i| f64::from(i) * dt).collect::<Vec<f64>>();
        assert!((longest_step(&every(0.1)) - 1.0).abs() < 1e-5);
        assert!((longest_step(&every(2.0)) - 3.0).abs() < 1e-5);
    }

    #[test]
    fn the_end_of_a_lap_is_no_driving() {
        let x: Vec<f64> = (0..400).map(|i| (f64::from(i) * 1.5) % 260.0).collect();
        assert!((largest_move(&x) - 7.5).abs() < 1e-9);
        assert_eq!(largest_move(&[3.0; 5]), f64::INFINITY);
    }
}
