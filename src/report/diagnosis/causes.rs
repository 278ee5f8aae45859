//! The causes that were tried, and the verdict.

use crate::diagnose::Verdict;
use crate::report::text::wrapped;
use crate::result::diagnosis::{CauseEntry, Outcome, ParameterEntry, RungEntry};
use crate::symbols::Symbol;
use crate::wgsl::{laws, library};
use std::fmt::{Result, Write};

/// Columns of the longest bar.
const BAR: usize = 24;
/// Causes shown per round: the best ones.
const SHOWN: usize = 10;

/// The ladder: evidence of every cause as a bar, the threshold as a mark in it.
pub(super) fn ladder(text: &mut String, rungs: &[RungEntry]) -> Result {
    if rungs.is_empty() {
        text.push_str("no cause came so far as to be compared on held-out stretches\n");
        return Ok(());
    }
    text.push_str(&wrapped(
        0,
        2,
        "Evidence: by how much the extended model predicts stretches better that it was not fitted to (gain in log-likelihood, in \
         nats). It counts above the threshold, marked | in the bar.",
    ));
    let rounds = rungs.iter().map(|rung| rung.round).max().unwrap_or(1);
    for round in 1..=rounds {
        let own = rungs.iter().filter(|rung| rung.round == round);
        let mut tried: Vec<(f64, &RungEntry)> = own.clone().filter_map(|rung| Some((rung.evidence?, rung))).collect();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        writeln!(text, "\nround {round}")?;
        match tried.is_empty() {
            true => text.push_str("no cause was promising enough to be compared on held-out stretches\n"),
            false => writeln!(text, "{:<22}{:>9}{:>10}", "cause", "evidence", "threshold")?,
        }
        for (evidence, rung) in tried.iter().take(SHOWN) {
            let (name, need) = (&rung.name, rung.threshold);
            writeln!(text, "{name:<22}{evidence:>9.0}{need:>10.0}  {}", bar(*evidence, need).trim_end())?;
            text.push_str(&wrapped(4, 4, &rung.fate));
        }
        let others: Vec<&str> = own.filter(|rung| rung.evidence.is_none()).map(|rung| rung.name.as_str()).collect();
        if !others.is_empty() {
            text.push_str(&wrapped(0, 2, &format!("screened, and less promising: {}", others.join(", "))));
        }
    }
    Ok(())
}

/// A bar on a logarithmic scale, on which the threshold stands at a third.
fn bar(evidence: f64, threshold: f64) -> String {
    let mark = BAR / 3;
    let ratio = (evidence.max(0.0) / threshold.max(1e-9)).max(1e-9);
    // Nothing at a tenth of the threshold, the full length at a hundred times it.
    let length = (mark as f64 * (1.0 + ratio.log10())).round().clamp(0.0, BAR as f64) as usize;
    (0..BAR)
        .map(|i| {
            if i == mark {
                '|'
            } else if i < length {
                '#'
            } else {
                ' '
            }
        })
        .collect()
}

/// The mark of a parameter on a bound.
pub(in crate::internal::report) const AT_BOUND: &str = "at its bound";
/// What follows from units that contradict each other.
pub(in crate::internal::report) const MEND_FIRST: &str = "Mend that first: no size below can be trusted until then";

/// Parameters with their intervals; those at a bound are marked.
pub(super) fn parameters(text: &mut String, parameters: &[ParameterEntry]) -> Result {
    for p in parameters {
        let interval = p.interval.map_or(String::new(), |[low, high]| format!("[{low:.4}, {high:.4}]"));
        let mark = if p.at_bound { AT_BOUND } else { "" };
        let row = format!("  {:<10}{:>12.4}  {:<6}{interval:<24}{mark}", p.name, p.value, p.unit);
        writeln!(text, "{}", row.trim_end())?;
    }
    Ok(())
}

/// What a parameter of a model, a built-in law or a built-in cause means; nothing of a user's own one.
pub(in crate::internal::report) fn meaning(parameter: &str) -> &'static str {
    let mut built_in = library().iter().chain(laws()).flat_map(|extension| extension.own_parameters());
    let own = || built_in.find(|symbol| symbol.name() == parameter);
    Symbol::from_name(parameter).or_else(own).map_or("", Symbol::meaning)
}

pub(super) fn verdict(text: &mut String, outcome: &Outcome) -> Result {
    let title = match outcome.verdict {
        Verdict::Named => "NAMED",
        Verdict::Ambiguous => "ONE OF SEVERAL; these data cannot tell which",
        Verdict::Nothing => "NOTHING IS MISSING that these drives show",
        Verdict::NotTestable => "NOT TESTABLE with these data",
        Verdict::Unexplained => "UNEXPLAINED: something is wrong that no cause of the library explains",
        Verdict::BadBase => "NO VERDICT: the base model does not fit",
        Verdict::Helps => "HELPS: an extension follows unseen drives better, and what the car does is not told apart",
    };
    text.push('\n');
    if let Some(first) = outcome.data_first() {
        text.push_str(&wrapped(0, 2, &format!("THE DATA FIRST. {first}")));
        text.push_str("\nFor what it is worth: ");
    }
    writeln!(text, "{title}")?;
    text.push_str(&wrapped(0, 2, &outcome.reason));
    if let Some(base) = outcome.likelier_base() {
        text.push_str(&wrapped(0, 2, &next(&base)));
    }
    for cause in &outcome.causes {
        one(text, cause)?;
    }
    for cause in &outcome.causes {
        let mut rivals = outcome.rivals(cause).peekable();
        if rivals.peek().is_some() {
            writeln!(text, "\nexplains the data as well as {}:", cause.name)?;
        }
        for rival in rivals {
            one(text, rival)?;
        }
    }
    if !outcome.not_testable.is_empty() {
        text.push_str("\nCannot be tested here, because the calibration absorbs it:\n");
        for entry in &outcome.not_testable {
            text.push_str(&wrapped(2, 4, &format!("{} (in {})", entry.name, entry.absorbed_by.join(", "))));
        }
    }
    if !outcome.not_tried.is_empty() {
        text.push_str("\nNot tried:\n");
        for entry in &outcome.not_tried {
            text.push_str(&wrapped(2, 4, &format!("{}: {}; {}", entry.name, entry.reason, entry.remedy)));
        }
    }
    Ok(())
}

/// What to do where the car follows the law of another base.
pub(in crate::internal::report) fn next(base: &str) -> String {
    format!("Next: the same command with --base {base}")
}

fn one(text: &mut String, cause: &CauseEntry) -> Result {
    let family = if cause.family == cause.name { String::new() } else { format!(" (family {})", cause.family) };
    let (evidence, threshold, kind) = (cause.evidence, cause.threshold, &cause.threshold_kind);
    text.push('\n');
    let how = match kind.as_str() {
        "bootstrap" => format!("{evidence:.1} standard errors better than the base"),
        kind => format!("evidence {evidence:.0}, threshold {threshold:.0} ({kind})"),
    };
    text.push_str(&wrapped(0, 2, &format!("{}{family}: {how}", cause.name)));
    parameters(text, &cause.parameters)?;
    let what: Vec<&str> = cause.equation.iter().chain(&cause.meaning).map(String::as_str).collect();
    if !what.is_empty() {
        text.push_str(&wrapped(2, 4, &what.join(": ")));
    }
    if let Some(recording) = &cause.recording {
        text.push_str(&wrapped(2, 4, &format!("in {recording}")));
    }
    Ok(())
}
