//! A time of day written as a number: 145959.9 is followed by 150000.0.

use super::finding::{Finding, FindingKind, Remedy, Who};
use crate::trajectory::error::problem::DAYS_STEP_S;
use crate::trajectory::prepare::median_step;

/// Of the steps of a clock, the one over a full minute is longer by this \[s\].
const MINUTE: f64 = 40.0;
/// The first invalid time of day.
const DAY: f64 = 240_000.0;

/// Finding that a time column holds a clock of the form HHMMSS, if it does.
pub(super) fn of_time(t: &[f64]) -> Option<Finding> {
    let usual = median_step(t)?;
    if usual < DAYS_STEP_S {
        return Some(Finding {
            matters: true,
            remedies: vec![Remedy::of("columns")],
            sentence: format!(
                "times of {} whose steps are {usual:.1e}: in days? A column map with unit = \"day\" for the time reads it",
                t[0]
            ),
            ..Finding::new(FindingKind::TimeUnit, Who::Both, "time", usual, "s")
        });
    }
    let is_clock = |t: f64| (0.0..DAY).contains(&t) && t % 100.0 < 60.0 && (t / 100.0).floor() % 100.0 < 60.0;
    if !t.iter().all(|&t| is_clock(t)) {
        return None;
    }
    let over_a_minute = |pair: &&[f64]| {
        let ([before, after], near) = ([pair[0] % 100.0, pair[1] % 100.0], 1.5 * usual);
        before >= 60.0 - near && after < near && pair[1] - pair[0] > MINUTE
    };
    let minutes = t.windows(2).filter(over_a_minute).count();
    let first = t.windows(2).find(over_a_minute)?;
    Some(Finding {
        when: vec![[first[0], first[1]]],
        matters: true,
        remedies: vec![Remedy::of("columns")],
        sentence: format!(
            "the time looks like a clock, HHMMSS: {} is followed by {}, as at {minutes} full minutes; a column map with \
             unit = \"hhmmss\" for the time reads it",
            first[0], first[1]
        ),
        ..Finding::new(FindingKind::TimeUnit, Who::Both, "time", minutes as f64, "-")
    })
}
