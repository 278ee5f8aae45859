//! Why a recording could not be turned into trajectories.

use super::Faults;
use crate::text::option::{FROM, LEAD_LENGTH, MAX_GAP, RESAMPLE, TO};

/// A recording could not be turned into trajectories.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    #[error("{option}: expected {expected}, found {found}")]
    Option { option: &'static str, expected: &'static str, found: f64 },
    #[error("{TO} {to} lies before {FROM} {from}; swap them")]
    Backwards { from: f64, to: f64 },
    #[error("{path}: no trajectory {id}; the file has {}", listed(available))]
    NoTrajectory { path: String, id: String, available: Vec<String> },
    #[error("{path}: no follower {follower}: {}; followers with data: {}", why_not(*follower), listed(available))]
    NoFollower { path: String, follower: usize, available: Vec<String> },
    #[error(
        "{path}: no spacing of follower {follower}: neither a measured gap nor positions of both cars; followers with a gap: {}",
        listed(available)
    )]
    NoSpacing { path: String, follower: usize, available: Vec<String> },
    #[error(
        "{path}: the length of the car ahead of follower {follower} is unknown, so its positions give no spacing: give the length ({LEAD_LENGTH})"
    )]
    NoLength { path: String, follower: usize },
    #[error(
        "{}\n{path}: follower {follower} cannot be used; followers that can: {}",
        faults.listed(path),
        listed(available)
    )]
    Faulty { path: String, follower: usize, faults: Faults, available: Vec<String> },
    #[error("{path}: no rows between {from} s and {to} s; the file runs from {first} s to {last} s")]
    EmptyWindow { path: String, from: f64, to: f64, first: f64, last: f64 },
    #[error(
        "{path}:{line}: {column}: expected {expected} (step {step} s), found {found}; the time step is irregular: resample with {RESAMPLE} {step}"
    )]
    Irregular { path: String, line: u64, column: &'static str, expected: f64, step: f64, found: f64 },
    #[error("{path}: {}", step_too_long(*step, *limit))]
    StepTooLong { path: String, step: f64, limit: f64 },
    #[error(
        "{path}: resampling to {step} s gives {samples:.0} samples, more than {limit}; choose a longer step or a shorter window"
    )]
    TooManySamples { path: String, step: f64, samples: f64, limit: usize },
    #[error(
        "{path}: follower {follower}: expected a stretch of at least {needed} s without long gaps, the longest has {longest} s; a longer {MAX_GAP} interpolates more"
    )]
    TooShort { path: String, follower: usize, needed: f64, longest: f64 },
    #[error("{path}: follower {follower}: expected at least {needed} s, the {what} has {found} s; {}", if *what == "window" { format!("widen {FROM} and {TO}") } else { "give a longer one".to_owned() })]
    Short { path: String, follower: usize, what: &'static str, needed: f64, found: f64 },
    #[error("{path}: follower {follower}: the spacing is {value} m at {t} s, expected above 0; {advice}")]
    Spacing { path: String, follower: usize, t: f64, value: f64, advice: &'static str },
}

fn why_not(follower: usize) -> String {
    match follower {
        0 => "followers count from 1, the one right behind the platoon leader".to_owned(),
        _ => format!("car {} or the car ahead of it is not in the file", follower.saturating_add(1)),
    }
}

/// Error of a time step of more than `limit` s, wherever it occurs.
pub(in crate::trajectory) fn step_too_long(step: f64, limit: f64) -> String {
    format!("expected a time step of at most {limit} s, found {step}; is the time in milliseconds?")
}

/// At most this many followers or trajectory ids are listed.
const SHOWN: usize = 12;

fn listed(names: &[String]) -> String {
    match names.len() {
        0 => "none".to_owned(),
        n if n > SHOWN => format!("{}, ... ({n} in all)", names[..SHOWN].join(", ")),
        _ => names.join(", "),
    }
}
