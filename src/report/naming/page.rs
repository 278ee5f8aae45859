//! The part of a Markdown page.

use crate::bench::{Bar, DiagnosisReport, Gains, Judgement, MOST_OF_IT, PowerAt, Silence, judge};
use std::fmt::Write;

/// The line after which the part begins.
pub const BEGIN: &str = "<!-- leadlag bench diagnosis: what follows is written by it -->";
/// The line before which it ends.
pub const END: &str = "<!-- leadlag bench diagnosis: end -->";

/// The origin of the numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Provenance {
    /// The command that gives them.
    pub command: String,
    /// Program and version.
    pub program: String,
    pub machine: String,
    /// The date of writing, such as `2026-11-23`.
    pub date: String,
}

/// Why a page cannot take the part.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum PageError {
    #[error(
        "expected the line `{BEGIN}` once, and the line `{END}` once below it; found them {begins} and {ends} times{order}; put both where the results belong",
        order = if *.begins == 1 && *.ends == 1 { ", in the wrong order" } else { "" }
    )]
    Marks { begins: usize, ends: usize },
}

/// The page with the part between the lines [`BEGIN`] and [`END`] replaced.
///
/// # Errors
/// A page without these two lines.
pub fn into_page(page: &str, part: &str) -> Result<String, PageError> {
    let (begins, ends) = (page.matches(BEGIN).count(), page.matches(END).count());
    let places = page.find(BEGIN).zip(page.find(END)).filter(|(begin, end)| begin < end);
    let Some((begin, end)) = places.filter(|_| begins == 1 && ends == 1) else {
        return Err(PageError::Marks { begins, ends });
    };
    Ok(format!("{}\n\n{}\n\n{}", &page[..begin + BEGIN.len()], part.trim(), &page[end..]))
}

/// Tables of a report; `pictures` are the addresses of [`super::names`] and [`super::power`].
#[must_use]
pub fn part(report: &DiagnosisReport, from: &Provenance, pictures: [&str; 2]) -> String {
    let mut text = String::new();
    let Provenance { command, program, machine, date } = from;
    let all = match report.outcomes.len() {
        done if done == report.planned => format!("all {done} cases"),
        done => format!("{done} of {} cases, which are shuffled", report.planned),
    };
    let failed = match report.failed() {
        0 => String::new(),
        failed => format!(", of which {failed} could not be generated"),
    };
    let [cpu, simulations] = report.cost;
    let _ = writeln!(
        text,
        "`{command}`: {all}{failed}. {program}, {machine}, written {date}. A case takes {cpu:.0} s of CPU in the median, and {simulations:.0} simulated candidates.\n"
    );
    text += "| target | reached | share | 95 % interval | wanted | |\n|---|---|---|---|---|---|\n";
    for bar in &report.bars {
        text += &target(bar);
    }
    text += "\n*Shown*: the truth, fitted from its own values, gains more than the threshold, each of two effects beside the other.\n\n";

    text += "| planted | cases | right | in the set | one of two | silent | of these not found | wrong |\n|---|---|---|---|---|---|---|---|\n";
    for (row, tally) in report.tallies.iter().filter(|(_, tally)| tally.cases > 0) {
        let of = [tally.cases, tally.right, tally.in_set, tally.half, tally.silent, tally.not_found, tally.wrong];
        let _ = writeln!(text, "| {row} | {} |", of.map(|n| n.to_string()).join(" | "));
    }
    text += "\n*Not found*: the truth, fitted from its own values, would have been named; the other silent ones lack evidence.\n\n";

    let [names, power] = pictures;
    let _ = writeln!(
        text,
        "![Planted effects, and their names]({names})\n\n![Share named by size of the effect]({power})\n"
    );
    text += &powers(report);
    text += &pairs(report);
    text += &silence(report);
    let [close, estimated] = report.close_estimates();
    let _ = writeln!(
        text,
        "Of the cases named right, {close} of {estimated} have all parameters within 10 % or three standard errors of the planted ones."
    );
    if let Some(Gains { median, most, cases }) = report.gains() {
        let _ = writeln!(
            text,
            "Extended models reach {:.0} % of the gain of the truth on the hold-out (NRMSE(s,v,a)) in the median, and at least {:.0} % in {most} of {cases} cases.",
            100.0 * median,
            100.0 * MOST_OF_IT
        );
    }
    text
}

fn target(bar: &Bar) -> String {
    let Bar { what, cases, count, .. } = bar;
    let met = bar.met().map_or("no case", |met| if met { "met" } else { "**missed**" });
    let share = if *cases > 0 { format!("{:.0} %", 100.0 * *count as f64 / *cases as f64) } else { "-".to_owned() };
    let [low, high] = bar.interval.map(|end| 100.0 * end);
    let wanted = format!("{} {} %", if bar.most { "≤" } else { "≥" }, 100.0 * bar.target);
    format!("| {what} | {count} of {cases} | {share} | {low:.0} to {high:.0} % | {wanted} | {met} |\n")
}

/// Single effects named right, by size: bases and all of them, then every effect.
fn powers(report: &DiagnosisReport) -> String {
    let sizes = report.powers.first().map_or(&[][..], |row| &row.sizes);
    if sizes.is_empty() {
        return String::new();
    }
    let head: Vec<String> = sizes.iter().map(|at| format!("{} m/s", at.rms_mps)).collect();
    let mut text = format!("| one effect, named right | {} |\n|---|{}\n", head.join(" | "), "---|".repeat(sizes.len()));
    for row in report.powers.iter().chain(&report.powers_by_effect) {
        let count =
            |at: &PowerAt| if at.cases > 0 { format!("{} of {}", at.right, at.cases) } else { "–".to_owned() };
        let counts: Vec<String> = row.sizes.iter().map(count).collect();
        let _ = writeln!(text, "| {} | {} |", row.of, counts.join(" | "));
    }
    text + "\n"
}

/// Every pair, and the answer.
fn pairs(report: &DiagnosisReport) -> String {
    let mut text = String::new();
    for outcome in report.outcomes.iter().filter(|o| o.task.kind == "pair") {
        let judged = match judge(outcome) {
            Judgement::Failed => continue,
            Judgement::Right => "right",
            Judgement::InSet => "in the set",
            Judgement::Half => "one of two",
            Judgement::Silent => "silent",
            Judgement::Wrong => "wrong",
        };
        let weak = match (&outcome.unknown, outcome.is_shown()) {
            (Some(_), _) => ", and whether the data show it is not known",
            (None, true) => "",
            (None, false) => ", not shown by the data",
        };
        let said = if outcome.adopted.is_empty() { outcome.verdict.clone() } else { outcome.adopted.join(" + ") };
        let task = &outcome.task;
        let _ =
            writeln!(text, "| {} | {} | {} | {said} | {judged}{weak} |", task.seed, task.base, task.causes.join(" + "));
    }
    if text.is_empty() {
        return text;
    }
    format!("| pair | base | planted | answer | |\n|---|---|---|---|---|\n{text}\n")
}

/// Distance of drives without an effect from a name.
fn silence(report: &DiagnosisReport) -> String {
    if report.silence.is_empty() {
        return String::new();
    }
    let mut text = "Drives without an effect: evidence of the likeliest cause, as a share of the threshold for a name (0 if none gains enough to be judged).\n\n\
        | | drives | median | one of 20 exceeds | highest |\n|---|---|---|---|---|\n"
        .to_owned();
    for Silence { of, cases, median, one_in_twenty, highest } in &report.silence {
        let _ = writeln!(text, "| {of} | {cases} | {median:.2} | {one_in_twenty:.2} | {highest:.2} |");
    }
    text + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_keeps_what_is_around_the_part() {
        let page = format!("# Title\n\nbefore\n\n{BEGIN}\nold\n{END}\n\nafter\n");
        let new = into_page(&page, "new\n").expect("a page with both lines");
        assert_eq!(new, format!("# Title\n\nbefore\n\n{BEGIN}\n\nnew\n\n{END}\n\nafter\n"));
        assert_eq!(into_page(&new, "new").expect("the same again"), new);
    }

    #[test]
    fn a_page_without_the_two_lines_is_refused() {
        assert_eq!(into_page("no lines", ""), Err(PageError::Marks { begins: 0, ends: 0 }));
        assert_eq!(into_page(&format!("{BEGIN}\n"), ""), Err(PageError::Marks { begins: 1, ends: 0 }));
        let twice = format!("{BEGIN}\n{END}\n{BEGIN}\n{END}\n");
        assert_eq!(into_page(&twice, ""), Err(PageError::Marks { begins: 2, ends: 2 }));
        let reversed = into_page(&format!("{END}\n{BEGIN}\n"), "").expect_err("in the wrong order");
        assert!(reversed.to_string().contains("in the wrong order"), "{reversed}");
    }
}
