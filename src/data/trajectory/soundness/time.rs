//! Times that are not seconds: minutes, hours or days; frames; a time of day as a number, where 145959.9 is followed by 150000.0.

use super::finding::{Finding, FindingKind, Remedy, Who};
use super::link::Link;
use crate::text::option::COLUMNS;
use crate::trajectory::error::problem::DAYS_STEP_S;
use crate::trajectory::prepare::{STEP_MAX_S, median_step};

/// Of the steps of a clock, the one over a full minute is longer by this \[s\].
const MINUTE: f64 = 40.0;
/// The first invalid time of day.
const DAY: f64 = 240_000.0;

/// Units of time that a table may have, their size \[s\] and their names in a column map.
const UNITS: [(f64, &str, &str); 3] = [(60.0, "minutes", "min"), (3600.0, "hours", "h"), (86_400.0, "days", "day")];
/// Usual rates of frames \[1/s\].
const RATES: [f64; 10] = [10.0, 12.5, 15.0, 20.0, 24.0, 25.0, 30.0, 50.0, 60.0, 100.0];
/// Largest ratio of the changes of the gap to those that the speeds imply at which both agree.
const AGREE: std::ops::Range<f64> = 0.8..1.25;
/// Ratio by which one frame rate differs from the next.
const NEAR: f64 = 0.03;

/// A finding that the time is in another unit than seconds, in which gap and speeds agree.
pub(super) fn of_unit(link: &Link) -> Option<Finding> {
    let agrees = |size: f64| link.ratio(size).is_some_and(|ratio| AGREE.contains(&ratio));
    let is_whole = |x: f64| (x - x.round()).abs() < 1e-9;
    let counted = is_whole(link.t_0) && is_whole(link.dt) && link.dt > 0.5;
    let longer = UNITS.into_iter().filter(|(size, ..)| size * link.dt < STEP_MAX_S);
    let (what, remedy) = if link.dt < DAYS_STEP_S {
        ("in days".to_owned(), "unit = \"day\"".to_owned())
    } else if counted {
        let found = link.dt / link.ratio(1.0)?;
        let rate = RATES.into_iter().find(|rate| (found / rate - 1.0).abs() < NEAR)?;
        (format!("frames, {rate} per second"), format!("unit = \"frame\" and frame_rate = {rate}"))
    } else {
        let mut longer = longer.peekable();
        longer.peek().filter(|_| !agrees(1.0))?;
        let (_, unit, name) = longer.find(|(size, ..)| agrees(*size))?;
        (format!("in {unit}"), format!("unit = \"{name}\""))
    };
    let step = if link.dt < 1e-3 { format!("{:.1e}", link.dt) } else { format!("{:.4}", link.dt) };
    Some(Finding {
        matters: true,
        remedies: vec![Remedy::of(COLUMNS)],
        sentence: format!(
            "times from {} on, with steps of {step}: {what}? A column map with {remedy} for the time reads it",
            link.t_0
        ),
        ..Finding::new(FindingKind::TimeUnit, Who::Both, "time", link.dt, "s")
    })
}

/// A finding that a time column holds times of day of the form HHMMSS.
pub(super) fn of_clock(t: &[f64]) -> Option<Finding> {
    let usual = median_step(t)?;
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
        remedies: vec![Remedy::of(COLUMNS)],
        sentence: format!(
            "the time looks like a clock, HHMMSS: {} is followed by {}, as at {minutes} full minutes; a column map with \
             unit = \"hhmmss\" for the time reads it",
            first[0], first[1]
        ),
        ..Finding::new(FindingKind::TimeUnit, Who::Both, "time", minutes as f64, "-")
    })
}
