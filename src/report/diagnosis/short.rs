//! What a diagnosis comes to, in words that a driver understands.

use super::causes::equation;
use crate::diagnose::Verdict;
use crate::diagnose::outcome::{CauseEntry, Outcome, ParameterEntry};
use crate::diagnose::recommended::{Recommended, RecommendedCause, Why};

fn base(outcome: &Outcome) -> &str {
    outcome.base.as_ref().map_or("the base", |base| base.variant.as_str())
}

/// The conclusion in one or two sentences.
#[must_use]
pub fn headline(outcome: &Outcome) -> String {
    let base = base(outcome);
    let list = |joint: &str| {
        let causes = outcome.causes.iter().chain(&outcome.confounded_with);
        causes.map(|cause| named(&cause.name, "", &cause.parameters)).collect::<Vec<_>>().join(joint)
    };
    let of = |cause: &CauseEntry| named(&cause.name, "", &cause.parameters);
    match outcome.verdict {
        Verdict::Named => {
            let causes: Vec<String> = outcome.causes.iter().map(of).collect();
            let gain = outcome.gain.as_ref().and_then(|gain| Some((gain.base?, gain.extended?)));
            let fall = |(base, extended): (f64, f64)| {
                format!(" With that the error on data held back falls by {:.0} %.", 100.0 * (1.0 - extended / base))
            };
            let fall = gain.filter(|(base, extended)| extended < base).map_or(String::new(), fall);
            format!("{base} lacks {}.{fall}", causes.join(", and "))
        }
        Verdict::Ambiguous => {
            format!("{base} lacks one of several, which these data cannot tell apart: {}.", list("; or "))
        }
        Verdict::Nothing => format!("{base} is enough for these drives."),
        Verdict::NotTestable => format!("These data cannot tell what {base} lacks."),
        Verdict::Unexplained => format!("{base} lacks something that no cause of the library explains."),
        Verdict::BadBase => format!("{base} does not fit these drives, so nothing can be found on it."),
        Verdict::Helps => format!("An extension follows unseen drives better than {base}; no cause is named."),
    }
}

/// A cause in words: its name, what it does, its sizes.
fn named(name: &str, own: &str, parameters: &[ParameterEntry]) -> String {
    let meaning = equation(name).map_or(own, |(_, meaning)| meaning).trim_end_matches('.');
    let sizes: Vec<String> = parameters.iter().map(parameter).collect();
    let what = [meaning.to_owned(), sizes.join(", ")].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>();
    format!("{name} ({})", what.join("; "))
}

/// Sentences, the most important first.
#[must_use]
pub fn in_short(outcome: &Outcome) -> Vec<String> {
    let base = base(outcome);
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
    named(&cause.name, &cause.meaning, &cause.parameters)
}

fn parameter(p: &ParameterEntry) -> String {
    let unit = if p.unit == "-" { String::new() } else { format!(" {}", p.unit) };
    let digits = if p.value.abs() < 0.1 { 4 } else { 2 };
    let interval = p.interval.map_or(String::new(), |[low, high]| format!(" [{low:.digits$}, {high:.digits$}]"));
    format!("{} = {:.digits$}{unit}{interval}", p.name, p.value)
}
