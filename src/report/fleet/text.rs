//! A fleet in some ten lines.

use super::{ADVICE, FleetFile, heading, percent, range};
use crate::fleet::{Overview, Spread};
use crate::report::html::short;
use crate::report::text::wrapped;
use crate::text::shown::counted;
use std::fmt::Write;

/// Number of printed reasons; the table has all.
const REASONS: usize = 3;

/// Number of named pairs with doubtful data, of each kind.
const DOUBTFUL: usize = 20;

/// Output of `calibrate --all`.
pub fn text(file: &FleetFile) -> String {
    let calibrated = file.calibrated();
    let whole = file.pairs * file.overview.len();
    let files = counted(file.data.len(), "file");
    let mut text =
        format!("{} of {files}: {calibrated} of {whole} calibrations have a result\n", counted(file.pairs, "pair"));
    for (reason, count) in file.reasons.iter().take(REASONS) {
        text += &wrapped(2, 4, &format!("{count} without: {reason}"));
    }
    if !file.doubtful.is_empty() {
        let (count, doubts) = (counted(file.doubtful.len(), "pair"), file.doubts(DOUBTFUL));
        let told = format!("{count} with doubtful data, in column findings of the table: {doubts}; {ADVICE}");
        text += &wrapped(2, 4, &told);
    }
    if file.overview.len() > 1 {
        text += &models(&file.overview);
    }
    for told in [file.rule(), file.verdict()].iter().filter(|told| !told.is_empty()) {
        text += &wrapped(0, 2, told);
    }
    let with_results = file.chosen_first().filter(|one| one.calibrated > 0);
    with_results.for_each(|one| text += &parameters(one, file.intervals));
    if let Some(note) = &file.note {
        text += &wrapped(0, 2, note);
    }
    text
}

fn models(all: &[Overview]) -> String {
    let mut text =
        format!("\n{:<26} {:<10} {:>9} {:>12} {:>18}\n", "model", "minimised", "median", "best on", "mean is higher");
    for one in all {
        let median = one.compared.or(one.score).map_or("–".to_owned(), |s| short(s.median));
        let best = format!("{} of {}", one.best, one.calibrated);
        let behind = one.behind.map_or("–".to_owned(), |behind| behind.in_words());
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{:<26} {:<10} {median:>9} {best:>12} {behind:>18}", one.model, one.gof);
    }
    for one in all.iter().filter(|one| one.failed > 0) {
        let told =
            format!("{}: ends early on {} of {} held back; its mean omits them", one.model, one.failed, one.calibrated);
        text += &wrapped(0, 2, &told);
    }
    text
}

/// Width of a name with the median behind it, in characters: a long name takes room from the median.
const NAME_AND_MEDIAN: usize = 22;

fn parameters(one: &Overview, intervals: bool) -> String {
    let row = |name: &str, [median, half, most, at_bound]: [&str; 4], determined: &str| {
        let room = NAME_AND_MEDIAN.saturating_sub(name.chars().count());
        format!("{name}{median:>room$} {half:>17} {most:>17} {at_bound:>8} {determined:>10}").trim_end().to_owned()
            + "\n"
    };
    let spread = |name: &str, spread: &Spread, at_bound: &str, determined: &str| {
        // A blank at least, because the name may leave no room.
        let median = format!(" {}", short(spread.median));
        row(name, [&median, &range(spread.middle_half), &range(spread.nine_tenths), at_bound], determined)
    };
    let mut text = format!("\n{}\n", one.model);
    text += &row("", ["median", "middle half", "5 to 95 %", "at bound"], if intervals { "determined" } else { "" });
    text += &one.score.as_ref().map_or(String::new(), |score| spread(&one.gof, score, "", ""));
    for parameter in &one.parameters {
        let Some(own) = &parameter.spread else { continue };
        let name = heading(parameter);
        let determined = parameter.determined.map_or(String::new(), percent);
        text += &spread(&name, own, &percent(parameter.at_bound), &determined);
    }
    let sound = one.parameters.iter().filter_map(|p| Some(format!("{} {}", p.name, short(p.sound?.median))));
    let sound: Vec<String> = sound.filter(|_| one.doubtful > 0).collect();
    if !sound.is_empty() {
        text += &wrapped(0, 2, &format!("Medians without the pairs of doubtful data: {}.", sound.join(", ")));
    }
    text
}
