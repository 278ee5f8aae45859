//! What a diagnosis comes to, in words that a driver understands.

use crate::diagnose::Verdict;
use crate::diagnose::outcome::{Outcome, ParameterEntry};
use crate::diagnose::recommended::{Recommended, RecommendedCause, Why};

/// Sentences, the most important first.
#[must_use]
pub fn in_short(outcome: &Outcome) -> Vec<String> {
    let base = outcome.base.as_ref().map_or("the base", |base| base.variant.as_str());
    let mut sentences = Vec::new();
    match (&outcome.recommended, &outcome.closed_loop.not_testable) {
        (Some(recommended), _) => sentences.extend(recommendation(base, recommended)),
        (None, Some(why)) => {
            sentences.push(format!("Whether an extension follows unseen drives better was not tested: {why}."))
        }
        (None, None) if outcome.verdict == Verdict::Helps => sentences.push(format!("{}.", outcome.reason)),
        (None, None) if outcome.closed_loop.bins != [0, 0] => {
            sentences.push(format!(
                "{base} follows unseen drives as well as any extension of it that comes through all of them."
            ));
        }
        (None, None) => {}
    }
    sentences.extend(outcome.base_notes.iter().map(|note| format!("The base model: {note}.")));
    sentences
}

fn recommendation(base: &str, recommended: &Recommended) -> Vec<String> {
    let causes: Vec<String> = recommended.causes.iter().map(cause).collect();
    let gain = &recommended.gain;
    let percent = |share: f64| 100.0 * share / gain.base;
    let [low, high] = gain.interval.map(percent);
    let better = recommended.per_drive.iter().filter(|drive| drive.extended < drive.base).count();
    let why = match recommended.why {
        Why::Confirmed => "The likelihood finds it in the data, too.",
        Why::Helps => "The likelihood does not name it as the cause.",
    };
    vec![
        format!("Recommended: {base} with {}.", causes.join(" and ")),
        format!(
            "With it the error on unseen drives falls by {:.0} % [{low:.0}, {high:.0}]; better in {better} of {}. {why}",
            percent(gain.base - gain.extended),
            recommended.per_drive.len()
        ),
    ]
}

fn cause(cause: &RecommendedCause) -> String {
    let parameters: Vec<String> = cause.parameters.iter().map(parameter).collect();
    format!("{} ({}; {})", cause.name, cause.meaning.trim_end_matches('.'), parameters.join(", "))
}

fn parameter(p: &ParameterEntry) -> String {
    let unit = if p.unit == "-" { String::new() } else { format!(" {}", p.unit) };
    let digits = if p.value.abs() < 0.1 { 4 } else { 2 };
    let interval = p.interval.map_or(String::new(), |[low, high]| format!(" [{low:.digits$}, {high:.digits$}]"));
    format!("{} = {:.digits$}{unit}{interval}", p.name, p.value)
}
