//! The report of a diagnosis: the chain of evidence in words and pictures.

use super::budget::budget;
use super::{Chart, MadeBy, Page, between, drives, escape, short};
use crate::internal::judge::Check;
use crate::report::diagnosis::causes::{AT_BOUND, MEND_FIRST, meaning};
use crate::report::diagnosis::pictures;
use crate::report::diagnosis::short::{fleet_in_words, in_short, unconfirmed};
use crate::result::diagnosis::recommended::{HorizonGain, Trial};
use crate::result::diagnosis::{CauseEntry, HeldBackEntry, Outcome, ParameterEntry};

/// One HTML file. `charts` are the simulations, drive by drive.
pub fn diagnosis(outcome: &Outcome, charts: Vec<Chart>, made: Option<&MadeBy>) -> String {
    let mut page = Page::default();
    let short = in_short(outcome);
    if !short.more.is_empty() {
        page.section("summary", "Consequences");
        short.more.iter().for_each(|sentence| page.paragraph(sentence));
    }
    data(&mut page, outcome);
    wrong(&mut page, outcome, charts);
    causes(&mut page, outcome);
    models(&mut page, outcome);
    gain(&mut page, outcome);
    left(&mut page, outcome);
    let base = outcome.base.as_ref().map_or("", |base| base.variant.as_str());
    let answer: Vec<String> = short.answer.iter().map(|sentence| escape(sentence)).collect();
    let (first, rest) = answer.split_first().expect("there is always a verdict");
    let lead = format!(
        "<p class=\"verdict {}{}\"><strong>{first}</strong> {}</p>",
        outcome.verdict.into_str(),
        if outcome.recommended.is_some() { " recommended" } else { "" },
        rest.join(" ")
    );
    let on = drives(outcome.data.iter().map(|data| (data.path.as_str(), data.name.as_str())));
    let title = format!("Diagnosis of {base}").trim_end_matches(" of ").to_owned() + &on;
    page.finish(&title, &lead, &outcome.to_json(), made)
}

/// The errors of the base model, and their breakdown.
fn wrong(page: &mut Page, outcome: &Outcome, charts: Vec<Chart>) {
    // A fleet has no simulation of each drive.
    if outcome.fleet.is_some() {
        return;
    }
    page.section("wrong", "What is wrong, and where?");
    page.paragraph("Measured car, base model and extended model, each simulated freely behind the measured car ahead.");
    outcome.broken_off.iter().for_each(|entry| page.paragraph(&format!("{}.", entry.told())));
    page.charts("Measured and simulated", "drive", charts);
    if let Some(shares) = &outcome.budget {
        let of = if outcome.broken_off.is_empty() { "" } else { ", on the drives that it completes" };
        budget(page, shares, &format!("Error of the base model's free simulation{of}"));
    }
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
    page.section("data", "Are the data sound?");
    outcome.fleet.iter().for_each(|fleet| page.paragraph(&fleet_in_words(fleet)));
    let row = |d: &crate::result::diagnosis::DataEntry| {
        vec![
            d.path.clone(),
            d.role.clone(),
            d.follower().map_or_else(|| "all".to_owned(), |follower| format!("{follower} {}", d.name)),
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

fn causes(page: &mut Page, outcome: &Outcome) {
    page.section("causes", "What explains it?");
    page.paragraph(&format!("Reason: {}.", outcome.reason));
    if let Some(why) = outcome.closed_loop.not_testable.as_ref().filter(|why| **why != outcome.reason) {
        page.paragraph(&format!("No extension was tried on unseen drives: {why}."));
    }
    if !outcome.closed_loop.trials.is_empty() {
        page.paragraph(
            "Each cause was added to the base model. Both were fitted without a part of the data and judged on that part: corrected \
             towards the measurement within seconds, and free over whole drives.",
        );
        page.picture("Models on unseen data", &pictures::race("Models on unseen data", &outcome.closed_loop));
        let row = |trial: &Trial| {
            let mut row = vec![trial.causes.join(" + ")];
            let percent = |gain: &HorizonGain| {
                let [low, high] = gain.interval;
                // A minus sign, because a table interprets a hyphen in front of text as a formula; adding 0 turns -0
                // into 0.
                let [gain, low, high] = [gain.gain, low, high].map(|share| (1000.0 * share).round() / 10.0 + 0.0);
                format!("{gain:.1} [{low:.1}, {high:.1}]").replace('-', "−")
            };
            row.extend(trial.horizons.iter().map(percent));
            let failed = trial.checks.iter().find(|check| !check.met);
            row.extend([
                format!("{:.1}", trial.standard_errors),
                format!("{:.4}", trial.probability),
                if trial.in_set { "yes" } else { "no" }.to_owned(),
                failed.map_or("passes".to_owned(), Check::in_words),
            ]);
            row
        };
        let first = &outcome.closed_loop.trials[0];
        let mut head = vec!["causes".to_owned()];
        head.extend(first.horizons.iter().map(|gain| {
            gain.horizon_s.map_or("gain over whole drives [%]".to_owned(), |s| format!("gain within {s:.0} s [%]"))
        }));
        head.extend(
            ["gain [standard errors]", "probability by chance", "as good as the best", "check"].map(str::to_owned),
        );
        let head: Vec<&str> = head.iter().map(String::as_str).collect();
        page.table("All models on unseen data", &head, &outcome.closed_loop.trials.iter().map(row).collect::<Vec<_>>());
    }
    entries(page, "Named", outcome.causes.iter());
    for cause in &outcome.causes {
        entries(page, &format!("As good as {}", cause.name), outcome.rivals(cause));
    }
    if !outcome.not_testable.is_empty() {
        let row = |n: &crate::diagnose::NotTestable| vec![n.name.clone(), n.absorbed_by.join(", ")];
        let rows: Vec<Vec<String>> = outcome.not_testable.iter().map(row).collect();
        page.table("Cannot be tested with these data", &["cause", "absorbed by"], &rows);
    }
    let row = |n: &crate::result::diagnosis::NotTriedEntry| vec![n.name.clone(), n.reason.clone(), n.remedy.clone()];
    let rows: Vec<Vec<String>> = outcome.not_tried.iter().map(row).collect();
    page.table("Not tried", &["cause", "why", "what to do"], &rows);
}

fn models(page: &mut Page, outcome: &Outcome) {
    page.section("model", "The model with it");
    if outcome.extended.is_none() {
        page.paragraph("No extension is recommended.");
    }
    let mut models = Vec::new();
    for (name, model) in [("base", &outcome.base), ("extended", &outcome.extended)] {
        for p in model.iter().flat_map(|model| model.of_car()) {
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
    page.table("Parameters", &["model", "parameter", "value", "95 % interval", "unit", "meaning", "warning"], &models);
}

fn entries<'a>(page: &mut Page, caption: &str, causes: impl Iterator<Item = &'a CauseEntry>) {
    let row = |cause: &CauseEntry| {
        let parameters: Vec<String> = cause.parameters.iter().map(value).collect();
        let evidence = match cause.threshold_kind.as_str() {
            "bootstrap" => format!("{:.1} standard errors", cause.evidence),
            kind => format!("{:.0} nats, {:.0} needed ({kind})", cause.evidence, cause.threshold),
        };
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
    page.table(caption, &["cause", "meaning", "term", "parameters", "evidence", "family"], &rows);
}

fn gain(page: &mut Page, outcome: &Outcome) {
    page.section("gain", "The gain on unseen drives");
    outcome.gain.iter().for_each(|gain| page.paragraph(&unconfirmed(gain)));
    let row = |label: &str, model: &str, errors: Option<([f64; 3], f64)>| {
        let errors = match errors {
            Some(([s, v, a], nrmse)) => [s, v, a, nrmse].map(short),
            None => std::array::from_fn(|_| "–".to_owned()),
        };
        [label.to_owned(), model.to_owned()].into_iter().chain(errors).collect::<Vec<String>>()
    };
    let of = |drive: &HeldBackEntry| {
        let base = row(&drive.label, "base", drive.rms.zip(drive.nrmse_sva));
        let recommended = drive.recommended.map(|e| row(&drive.label, "recommended", Some((e.rms, e.nrmse_sva))));
        std::iter::once(base).chain(recommended).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = outcome.base_held_back.iter().flat_map(of).collect();
    let head = ["drive", "model", "spacing [m]", "speed [m/s]", "acceleration [m/s²]", "NRMSE(s,v,a)"];
    if !rows.is_empty() {
        page.paragraph("Root mean square errors on data that the fits left out. A dash: the simulation ends early.");
    }
    page.table("Errors on data left out of the fits", &head, &rows);
}

fn left(page: &mut Page, outcome: &Outcome) {
    page.section("left", "What is left");
    let row = |l: &crate::result::diagnosis::LeftOverEntry| vec![l.kind.clone(), l.r#where.clone(), short(l.size)];
    let rows: Vec<Vec<String>> = outcome.left_over.iter().map(row).collect();
    page.table("Left over", &["kind", "where", "size"], &rows);
    page.paragraph(&format!("{} simulations, seed {}, effort {}.", outcome.simulations, outcome.seed, outcome.effort));
}
