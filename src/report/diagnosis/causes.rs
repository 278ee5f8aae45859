//! The causes that were tried, and the verdict.

use super::short::parameter;
use crate::report::text::wrapped;
use crate::result::diagnosis::recommended::Trial;
use crate::result::diagnosis::{CauseEntry, NotTriedEntry, Outcome};
use crate::symbols::Symbol;
use crate::text::option::BASE;
use crate::wgsl::{laws, library};
use indexmap::IndexMap;
use std::fmt::{Result, Write};

/// Number of models shown, the best ones.
const SHOWN: usize = 4;

/// The models of the race that gain most.
pub(super) fn race(text: &mut String, outcome: &Outcome) -> Result {
    let race = &outcome.closed_loop;
    if let Some(why) = race.not_testable.as_ref().filter(|why| **why != outcome.reason) {
        text.push_str(&wrapped(0, 2, &format!("No extension was tried on unseen drives: {why}.")));
    }
    let mut trials: Vec<&Trial> = race.trials.iter().collect();
    let Some(first) = trials.first() else { return Ok(()) };
    let heads = first.horizons.iter().map(|gain| gain.horizon_s.map_or("drive".to_owned(), |s| format!("{s:.0} s")));
    let heads: String = heads.map(|head| format!("{head:>8}")).collect();
    writeln!(text, "{:<38}{heads}{:>10}", "less error on unseen data [%] over", "in s.e.")?;
    trials.sort_by(|a, b| b.standard_errors.total_cmp(&a.standard_errors));
    for trial in trials.iter().take(SHOWN) {
        let gains: String = trial.horizons.iter().map(|gain| format!("{:>+8.1}", 100.0 * gain.gain)).collect();
        let mark = if trial.in_set { " =" } else { "" };
        writeln!(text, "{:<38}{gains}{:>10.1}{mark}", trial.causes.join(" + "), trial.standard_errors)?;
    }
    Ok(())
}

/// Mark of a parameter on a bound.
pub(in crate::internal::report) const AT_BOUND: &str = "at its bound";
/// The consequence of units that contradict each other.
pub(in crate::internal::report) const MEND_FIRST: &str = "Correct this first; until then, no size below is reliable";

/// Meaning of a parameter of a model, a built-in law or a built-in cause; empty for a user's own.
pub(in crate::internal::report) fn meaning(parameter: &str) -> &'static str {
    let mut built_in = library().iter().chain(laws()).flat_map(|extension| extension.own_parameters());
    let own = || built_in.find(|symbol| symbol.name() == parameter);
    Symbol::from_name(parameter).or_else(own).map_or("", Symbol::meaning)
}

pub(super) fn verdict(text: &mut String, outcome: &Outcome) {
    let mut reason = outcome.reason.clone();
    if let Some(first) = outcome.data_first() {
        text.push_str(&wrapped(0, 2, &format!("CHECK THE DATA FIRST. {first}")));
        reason = format!("Tentative verdict: {reason}");
    }
    text.push_str(&wrapped(0, 2, &reason));
    for cause in &outcome.causes {
        one(text, outcome, cause);
    }
    let absorbed: Vec<&str> = outcome.not_testable.iter().map(|entry| entry.name.as_str()).collect();
    for (what, list) in [
        ("Not testable, because a calibration absorbs them", absorbed.join(", ")),
        ("Not tried", not_tried(outcome.not_tried.iter())),
    ] {
        if !list.is_empty() {
            text.push_str(&wrapped(0, 2, &format!("{what}: {list}")));
        }
    }
}

/// Causes that could not be tried, by reason.
pub(super) fn not_tried<'a>(entries: impl Iterator<Item = &'a NotTriedEntry>) -> String {
    let mut all: IndexMap<&str, Vec<&str>> = IndexMap::new();
    entries.for_each(|entry| all.entry(&entry.reason).or_default().push(&entry.name));
    all.iter().map(|(reason, names)| format!("{} ({reason})", names.join(", "))).collect::<Vec<_>>().join("; ")
}

/// The next command if the car follows the law of another base.
pub(in crate::internal::report) fn next(base: &str) -> String {
    format!("Next: the same command with {BASE} {base}")
}

/// A named cause: its term, and the causes that explain the data as well; the conclusion has its sizes.
fn one(text: &mut String, outcome: &Outcome, cause: &CauseEntry) {
    let place = cause.recording.as_ref().map(|recording| format!("in {recording}"));
    let lines: Vec<String> = [cause.equation.clone(), place].into_iter().flatten().collect();
    if !lines.is_empty() {
        text.push_str(&wrapped(0, 2, &format!("{}: {}", cause.name, lines.join("; "))));
    }
    let rivals: Vec<String> = outcome.rivals(cause).map(sized).collect();
    if !rivals.is_empty() {
        let rivals = format!("as good as {}: {}", cause.name, rivals.join(", "));
        text.push_str(&wrapped(2, 4, &rivals));
    }
}

/// A cause with its sizes, on one line.
fn sized(cause: &CauseEntry) -> String {
    let sizes: Vec<String> = cause.parameters.iter().map(parameter).collect();
    if sizes.is_empty() { cause.name.clone() } else { format!("{} ({})", cause.name, sizes.join(", ")) }
}
