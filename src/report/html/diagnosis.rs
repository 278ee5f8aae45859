//! The report of a diagnosis: the chain of evidence in words and pictures.

use super::budget::budget;
use super::{Chart, MadeBy, Page, between, escape, short};
use crate::diagnose::describe::gain::Gain;
use crate::report::diagnosis::causes::{AT_BOUND, MEND_FIRST, meaning};
use crate::report::diagnosis::pictures;
use crate::report::diagnosis::short::in_short;
use crate::result::diagnosis::{CauseEntry, HeldBackEntry, Outcome, ParameterEntry};

/// One HTML file. `charts` are the simulations, drive by drive.
#[must_use]
pub fn diagnosis(outcome: &Outcome, charts: Vec<Chart>, made: Option<&MadeBy>) -> String {
    let mut page = Page::default();
    summary(&mut page, outcome);
    page.section("simulation", "What the simulation gets wrong");
    page.paragraph("Measured car, base model and extended model, each simulated freely behind the measured car ahead.");
    outcome.broken_off.iter().for_each(|entry| page.paragraph(&format!("{}.", entry.told())));
    page.charts("Measured and simulated", "drive", charts);
    errors(&mut page, outcome);
    causes(&mut page, outcome);
    gain(&mut page, outcome);
    data(&mut page, outcome);
    left(&mut page, outcome);
    let base = outcome.base.as_ref().map_or("", |base| base.variant.as_str());
    let short = in_short(outcome);
    let answer: Vec<String> = short.answer.iter().map(|sentence| escape(sentence)).collect();
    let (first, rest) = answer.split_first().expect("there is always a verdict");
    let lead = format!(
        "<p class=\"verdict {}{}\"><strong>{first}</strong> {}</p>",
        outcome.verdict.into_str(),
        if outcome.recommended.is_some() { " recommended" } else { "" },
        rest.join(" ")
    );
    page.finish(&format!("Diagnosis of {base}"), &lead, &outcome.to_json(), made)
}

fn summary(page: &mut Page, outcome: &Outcome) {
    page.section("summary", "Summary");
    in_short(outcome).more.iter().for_each(|sentence| page.paragraph(sentence));
    let mut facts = vec![("evidence", outcome.reason.clone())];
    match &outcome.gain {
        Some(gain) => facts.push(("gain on the data held back", gain.sentence.clone())),
        None if outcome.gain_error.is_some() => facts.push(("gain on the data held back", "not measured".to_owned())),
        None => facts.push(("gain on the data held back", "none, as nothing is named".to_owned())),
    }
    facts.push((
        "faults of the data",
        match outcome.data_findings.len() + outcome.data.iter().filter(|entry| entry.units.is_some()).count() {
            0 => "none found".to_owned(),
            n => format!("{n}, see below"),
        },
    ));
    let list: String = facts.iter().map(|(k, v)| format!("<dt>{k}</dt><dd>{}</dd>", escape(v))).collect();
    page.raw(&format!("<dl>{list}</dl>"));
    if let Some(missing) = &outcome.missing {
        page.paragraph(
            "The missing acceleration has to be added to the model's acceleration, at each instant, so that the simulated car follows the \
             measured one. A dependence on a signal hints at the cause.",
        );
        let svg = pictures::missing("Missing acceleration", missing, outcome.missing_left.as_ref());
        page.picture("Missing acceleration against signals", &svg);
    }
}

fn value(p: &ParameterEntry) -> String {
    let unit = if p.unit == "-" { String::new() } else { format!(" {}", p.unit) };
    format!("{} = {}{unit} [{}]", p.name, short(p.value), between(p.interval))
}

fn data(page: &mut Page, outcome: &Outcome) {
    page.section("data", "The data");
    let row = |d: &crate::result::diagnosis::DataEntry| {
        vec![
            d.path.clone(),
            d.role.clone(),
            format!("{} {}", d.follower, d.name),
            format!("{:.1} to {:.1}", d.window_s[0], d.window_s[1]),
            d.samples.to_string(),
            d.gap_rate_rms_mps.map_or("–".to_owned(), short),
            d.sha256.chars().take(16).collect(),
        ]
    };
    let rows: Vec<Vec<String>> = outcome.data.iter().map(row).collect();
    let head = ["file", "role", "follower", "window [s]", "samples", "gap against speeds [m/s]", "sha256"];
    page.table("Files", &head, &rows);
    for (entry, moved) in outcome.data.iter().filter_map(|entry| Some((entry, entry.moved()?))) {
        page.paragraph(&format!("{} was {moved}.", entry.path));
    }
    page.paragraph(&outcome.held_back);
    for entry in &outcome.data {
        let told = |units: &String| format!("{}: {units}. {MEND_FIRST}.", entry.path);
        entry.units.iter().for_each(|units| page.paragraph(&told(units)));
    }
    if outcome.data_findings.is_empty() && !outcome.has_bad_data() {
        page.paragraph("Gap and speeds do not contradict each other.");
    } else if !outcome.data_findings.is_empty() {
        let row = |f: &crate::result::diagnosis::FindingEntry| {
            let done = f.correction.clone().unwrap_or_else(|| "not corrected".to_owned());
            vec![f.name.clone(), f.told(), format!("{} {}", short(f.value), f.unit), done, f.file.clone()]
        };
        let rows: Vec<Vec<String>> = outcome.data_findings.iter().map(row).collect();
        page.table("Faults of the data", &["fault", "in words", "size", "done", "file"], &rows);
    }
}

fn errors(page: &mut Page, outcome: &Outcome) {
    page.section("errors", "Where and when it errs");
    if let Some(shares) = &outcome.budget {
        let of = if outcome.broken_off.is_empty() { "" } else { ", over the drives whose end it reaches" };
        budget(page, shares, &format!("Error of the base model's free simulation on the training data{of}"));
    } else if !outcome.broken_off.is_empty() {
        outcome.broken_off.iter().for_each(|entry| page.paragraph(&format!("{}.", entry.told())));
    }
}

fn causes(page: &mut Page, outcome: &Outcome) {
    page.section("causes", "Which cause");
    if outcome.ladder.iter().any(|rung| rung.evidence.is_some()) {
        page.paragraph(
            "Each cause was put into the base model, and both were fitted again. Gain held out: gain in log-likelihood of the model with \
             the cause on stretches that it was not fitted to (nats). A cause counts if the gain exceeds the threshold, which is higher \
             for a further cause than for the first.",
        );
        page.picture("Ladder of causes", &pictures::ladder("Causes that were tried", &outcome.ladder));
        let row = |rung: &crate::result::diagnosis::RungEntry| {
            let number =
                |x: Option<f64>| x.map_or("–".to_owned(), |x| format!("{:.1}", (10.0 * x).round() / 10.0 + 0.0));
            let need = format!("{:.1}", rung.threshold);
            vec![
                rung.round.to_string(),
                rung.name.clone(),
                number(rung.gain),
                number(rung.evidence),
                need,
                rung.fate.clone(),
            ]
        };
        let head =
            ["round", "cause", "gain where fitted [nats]", "gain held out [nats]", "needed", "what became of it"];
        page.table("All that was tried", &head, &outcome.ladder.iter().map(row).collect::<Vec<_>>());
    }
    entries(page, "Adopted", outcome.causes.iter());
    for cause in &outcome.causes {
        entries(page, &format!("Explains the data as well as {}", cause.name), outcome.rivals(cause));
    }
    if !outcome.not_testable.is_empty() {
        let row = |n: &crate::diagnose::NotTestable| vec![n.name.clone(), n.absorbed_by.join(", ")];
        let rows: Vec<Vec<String>> = outcome.not_testable.iter().map(row).collect();
        page.table("Cannot be tested with these data", &["cause", "absorbed by"], &rows);
    }
    let row = |n: &crate::result::diagnosis::NotTriedEntry| vec![n.name.clone(), n.reason.clone(), n.remedy.clone()];
    let rows: Vec<Vec<String>> = outcome.not_tried.iter().map(row).collect();
    page.table("Not tried", &["cause", "why", "what to do"], &rows);
    let mut models = Vec::new();
    for (name, model) in [("base", &outcome.base), ("extended", &outcome.extended)] {
        for p in model.iter().flat_map(|model| &model.parameters) {
            let (value, interval) = (short(p.value), between(p.interval));
            models.push(vec![
                name.to_owned(),
                p.name.clone(),
                value,
                interval,
                p.unit.clone(),
                meaning(&p.name).to_owned(),
                if p.at_bound { AT_BOUND } else { "" }.to_owned(),
            ]);
        }
    }
    page.table(
        "Parameters of both models",
        &["model", "parameter", "value", "95 % interval", "unit", "meaning", "warning"],
        &models,
    );
}

fn entries<'a>(page: &mut Page, caption: &str, causes: impl Iterator<Item = &'a CauseEntry>) {
    let row = |cause: &CauseEntry| {
        let parameters: Vec<String> = cause.parameters.iter().map(value).collect();
        let evidence = format!("{:.0} nats, {:.0} needed ({})", cause.evidence, cause.threshold, cause.threshold_kind);
        vec![
            cause.name.clone(),
            cause.meaning.clone().unwrap_or_default(),
            cause.equation.clone().unwrap_or_default(),
            parameters.join("; ") + &cause.recording.as_ref().map_or(String::new(), |file| format!("; in {file}")),
            evidence,
            if cause.family == cause.name { String::new() } else { cause.family.clone() },
        ]
    };
    let rows: Vec<Vec<String>> = causes.map(row).collect();
    page.table(caption, &["cause", "meaning", "term", "parameters", "evidence of need", "family"], &rows);
}

fn gain(page: &mut Page, outcome: &Outcome) {
    page.section("gain", "Gain on the data held back");
    match &outcome.gain {
        Some(gain) => {
            page.paragraph(&gain.sentence);
            scores(page, gain);
        }
        None => {
            page.paragraph(outcome.gain_error.as_deref().unwrap_or("Nothing is named, so there is nothing to gain."))
        }
    }
    let row = |drive: &HeldBackEntry| {
        let [s, v, a] = drive.rms.map_or([None; 3], |rms| rms.map(Some));
        let errors = [s, v, a, drive.nrmse_sva].map(|error| error.map_or("–".to_owned(), short));
        std::iter::once(drive.label.clone()).chain(errors).collect()
    };
    let rows: Vec<Vec<String>> = outcome.base_held_back.iter().map(row).collect();
    let head = ["drive", "spacing [m]", "speed [m/s]", "acceleration [m/s²]", "NRMSE(s,v,a)"];
    if !rows.is_empty() {
        page.paragraph(
            "Below: root mean square errors of the base model's free simulation. A dash: the simulation ends early.",
        );
    }
    page.table("The base model on the drives held back", &head, &rows);
}

/// Errors of both models where both reach the end of the held-back data, and crashes in any case.
fn scores(page: &mut Page, gain: &Gain) {
    let row = |k: usize| {
        let mut row = vec![["base", "extended"][k].to_owned()];
        row.extend(gain.signals.map_or(std::array::from_fn(|_| "–".to_owned()), |signals| signals[k].map(short)));
        let broken = gain.crashes();
        row.extend(broken.map(|broken| format!("{} of {}", broken[k], broken[2])));
        row
    };
    page.table(
        "NRMSE of the free simulation",
        &["model", "spacing", "speed", "acceleration", "crashes, held back", "crashes, training"],
        &[row(0), row(1)],
    );
}

fn left(page: &mut Page, outcome: &Outcome) {
    page.section("left", "What is left");
    let row = |l: &crate::result::diagnosis::LeftOverEntry| {
        vec![l.kind.clone(), l.r#where.clone(), short(l.size), l.formula.clone().unwrap_or_default()]
    };
    let rows: Vec<Vec<String>> = outcome.left_over.iter().map(row).collect();
    page.table("Left over", &["kind", "where", "size", "formula (a description, not a cause)"], &rows);
    page.paragraph(&format!("{} simulations, seed {}, effort {}.", outcome.simulations, outcome.seed, outcome.effort));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors are compared only where both models reach the end; crashes matter most where one does not.
    #[test]
    fn crashes_are_told_where_there_are_some() {
        let gain = Gain {
            base: None,
            extended: Some(0.2),
            interval: None,
            signals: None,
            broken_off: [3, 1],
            drives: 9,
            broken_off_held_back: [2, 0, 4],
            parameters: Default::default(),
            sentence: String::new(),
        };
        let mut page = Page::default();
        scores(&mut page, &gain);
        let html = page.finish("", "", "{}", None);
        for told in ["crashes, held back", "2 of 4", "0 of 4", "1 of 5"] {
            assert!(html.contains(told), "{told}: {html}");
        }
    }
}
