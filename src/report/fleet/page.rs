//! The page of a fleet: the drivers first, then the quality of the fits, then the data.

use super::figures::{self, Distribution};
use super::forest::{Estimates, forest};
use super::{ADVICE, FleetFile, heading, percent, range};
use crate::fleet::Overview;
use crate::report::html::{MadeBy, Page, escape, short, within};
use crate::text::shown::counted;

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// The pair, from 1.
    pub pair: usize,
    /// Its name: the id of the trajectory or the name of the follower; otherwise its number.
    pub name: String,
    /// Its file and trajectory.
    pub label: String,
    pub model: String,
    /// The minimised measure.
    pub gof: String,
    /// Kinds of the faults of the data that change the calibration, blanks between them.
    pub findings: String,
    /// Time step \[s\].
    pub step_s: f64,
    /// The score; NaN without a result.
    pub score: f64,
    /// The parameters in the order of the overview of the model.
    pub values: Vec<f64>,
    /// The ends of their intervals, `None` if the drive does not determine them.
    pub ends: Vec<Option<[f64; 2]>>,
}

/// The signals of a fit: time, measured and simulated spacing, measured and simulated speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The pair, from 1.
    pub pair: usize,
    /// \[s\], \[m\], \[m\], \[m/s\], \[m/s\].
    pub signals: [Vec<f64>; 5],
}

/// Largest number of drivers that have a row each; for more, a histogram is drawn.
const FEW: usize = 40;

/// One HTML page; `twin` is the text of `fleet.json`, `made` the command that made it, if known.
pub fn page(file: &FleetFile, rows: &[Shown], fits: &[Fit], twin: &str, made: Option<&MadeBy>) -> String {
    let mut page = Page::default();
    let first = file.overview.first().map_or("", |one| one.gof.as_str());
    let models = file.overview.iter().filter(|one| one.gof == first).count();
    let best = file.chosen();
    if let Some(one) = best {
        drivers(&mut page, one, rows);
    }
    if let Some(note) = &file.note {
        page.paragraph(&format!("Note: {note}."));
    }
    if file.overview.len() > 1 {
        compared(&mut page, file, rows);
    }
    if let Some(one) = best {
        scores(&mut page, one, rows, fits);
    }
    data(&mut page, file);
    let lead = best.map_or(String::new(), |one| lead(file, one, models)) + &doubtful(file);
    page.finish("Many drivers", &lead, twin, made)
}

/// The result in a sentence or two.
fn lead(file: &FleetFile, one: &Overview, models: usize) -> String {
    let mut facts = Vec::new();
    for parameter in &one.parameters {
        if let Some(spread) = parameter.spread.filter(|spread| spread.nine_tenths[0] < spread.nine_tenths[1]) {
            let unit = if parameter.unit == "-" { String::new() } else { format!(" {}", parameter.unit) };
            facts.push(format!("{} {}{unit}", parameter.name, short(spread.median)));
        }
    }
    let wins = match file.verdict() {
        told if told.is_empty() => String::new(),
        told => format!(", one of {models} models. {}", told.trim_end_matches('.')),
    };
    format!(
        "<p class=\"verdict\"><strong>{} of {} calibrated with {}</strong>{}. The median driver: {}.</p>",
        one.calibrated,
        counted(file.pairs, "pair"),
        escape(&one.model),
        escape(&wins),
        escape(&facts.join(", "))
    )
}

/// The pairs whose data have faults, and which.
fn doubtful(file: &FleetFile) -> String {
    if file.doubtful.is_empty() {
        return String::new();
    }
    format!(
        "<p class=\"verdict bad_base\"><strong>{} with doubtful data:</strong> {}; {ADVICE}.</p>",
        counted(file.doubtful.len(), "pair"),
        escape(&file.doubts(usize::MAX))
    )
}

/// The rows of a model and measure that have a result.
fn of<'a>(one: &Overview, rows: &'a [Shown]) -> Vec<&'a Shown> {
    rows.iter().filter(|row| row.model == one.model && row.gof == one.gof && row.score.is_finite()).collect()
}

fn drivers(page: &mut Page, one: &Overview, rows: &[Shown]) {
    page.section("drivers", "The drivers");
    let own = of(one, rows);
    let varying = varying(one, &own);
    let values: Vec<Vec<f64>> = varying.iter().map(|i| own.iter().map(|row| row.values[*i]).collect()).collect();
    let shown: Vec<Distribution> = varying
        .iter()
        .zip(&values)
        .map(|(i, values)| Distribution {
            name: heading(&one.parameters[*i]),
            values,
            spread: one.parameters[*i].spread,
        })
        .collect();
    if own.len() <= FEW {
        let ends = |i: usize| own.iter().map(|row| row.ends[i]).collect();
        let estimates: Vec<Estimates> =
            shown.iter().zip(&varying).map(|(of, i)| Estimates { of: of.clone(), ends: ends(*i) }).collect();
        let names: Vec<&str> = own.iter().map(|row| row.name.as_str()).collect();
        page.picture("The drivers, with 95 % intervals", &forest(&names, &estimates));
        page.paragraph("A grey point: the drive does not determine the value. The line is the median.");
    } else {
        page.picture("Distribution of the parameters over the drivers", &figures::histograms(&shown));
        page.paragraph("The line is the median; half of the drivers are in the dark part.");
    }
    tables(page, one, rows, "");
    page.paragraph(
        "At a bound: the drive requires a value beyond the bounds, or does not determine it. Determined: the 95 % interval of the value excludes \
         at least half of the bounds.",
    );
    if shown.len() > 1 {
        page.picture("Which parameters go together", &figures::together(&shown));
        page.paragraph(
            "Darker: more drivers. The number is the rank correlation. It includes the errors of the estimates: parameters of one drive compensate \
             for each other.",
        );
    }
}

/// Places of the parameters that differ between drivers: a fixed one contains no information about them.
fn varying(one: &Overview, own: &[&Shown]) -> Vec<usize> {
    let varies = |i: &usize| own.iter().any(|row| row.values[*i] != own[0].values[*i]);
    (0..one.parameters.len()).filter(varies).collect()
}

/// The parameters of a model: of each driver if they are few, and over all drivers. `model` ends the captions.
fn tables(page: &mut Page, one: &Overview, rows: &[Shown], model: &str) {
    let own = of(one, rows);
    let varying = varying(one, &own);
    if own.len() <= FEW {
        let names: Vec<String> = varying.iter().map(|i| heading(&one.parameters[*i])).collect();
        let head: Vec<&str> =
            ["driver", one.gof.as_str()].into_iter().chain(names.iter().map(String::as_str)).collect();
        let row = |row: &&Shown| {
            let cell = |i: &usize| match row.ends[*i] {
                Some(ends) => {
                    let [value, low, high] = [row.values[*i], ends[0], ends[1]].map(|x| within(x, ends));
                    // A real minus sign, because a leading hyphen would look like a formula.
                    format!("{value} [{low}, {high}]").replace('-', "−")
                }
                None => format!("({})", short(row.values[*i])).replace('-', "−"),
            };
            [row.name.clone(), short(row.score)].into_iter().chain(varying.iter().map(cell)).collect()
        };
        page.table(&format!("Driver by driver{model}"), &head, &own.iter().map(row).collect::<Vec<_>>());
    }
    let row = |parameter: &crate::fleet::ParameterOverview| {
        let spread = parameter.spread?;
        Some(vec![
            parameter.name.clone(),
            short(spread.median),
            parameter.unit.clone(),
            range(spread.middle_half),
            range(spread.nine_tenths),
            percent(parameter.at_bound),
            parameter.determined.map_or("–".to_owned(), percent),
        ])
    };
    let table: Vec<Vec<String>> = one.parameters.iter().filter_map(row).collect();
    let share = |row: usize, column: usize| match column {
        5 => Some(one.parameters[row].at_bound),
        6 => one.parameters[row].determined,
        _ => None,
    };
    let head = ["parameter", "median", "unit", "middle half", "5 to 95 %", "at a bound", "determined"];
    page.table_with(&format!("Parameters over all pairs{model}"), &head, &table, &share);
}

fn compared(page: &mut Page, file: &FleetFile, rows: &[Shown]) {
    let all = &file.overview;
    page.section("models", "Which model fits best");
    let row = |one: &Overview| {
        let own = one.score.map_or("–".to_owned(), |score| short(score.median));
        let [median, range] =
            one.compared.map_or(["–".to_owned(), "–".to_owned()], |s| [short(s.median), range(s.nine_tenths)]);
        let behind = one.behind.map_or("–".to_owned(), |behind| behind.in_words());
        let best = format!("{} of {}", one.best, one.calibrated);
        vec![one.model.clone(), one.gof.clone(), own, median, range, best, behind, one.failed.to_string()]
    };
    let lines: Vec<Vec<String>> = all.iter().map(row).collect();
    let share =
        |row: usize, column: usize| (column == 5).then(|| all[row].best as f64 / all[row].calibrated.max(1) as f64);
    let head = [
        "model",
        "minimised",
        "median on the own drives",
        "median compared",
        "5 to 95 %",
        "best on",
        "mean is higher by [95 %]",
        "ends early on",
    ];
    page.table_with("Models", &head, &lines, &share);
    page.paragraph(&file.rule());
    page.paragraph(
        "Best on: pairs on which the model leads all others by more than the autocorrelated noise of the drive. Mean is higher by: the 95 % \
         interval of the ratio to the model with the lowest scores; if it contains 0 %, the drives do not distinguish the two.",
    );
    for one in file.chosen_first().skip(1) {
        tables(page, one, rows, &format!(": {}, {}", one.model, one.gof));
    }
}

fn scores(page: &mut Page, one: &Overview, rows: &[Shown], fits: &[Fit]) {
    page.section("fits", "How well it fits");
    let own: Vec<f64> = of(one, rows).iter().map(|row| row.score).collect();
    let name = format!("{} (lower is better)", one.gof);
    page.picture("The scores", &figures::histograms(&[Distribution { name, values: &own, spread: one.score }]));
    if fits.is_empty() {
        return;
    }
    let of_pair =
        |pair: usize| rows.iter().filter(move |row| row.pair == pair && row.gof == one.gof && row.score.is_finite());
    let named: Vec<(String, &Fit)> = fits
        .iter()
        .map(|fit| {
            let best = of_pair(fit.pair).min_by(|a, b| a.score.total_cmp(&b.score));
            (best.map_or(String::new(), |row| format!("{}: {} {}", row.name, row.model, short(row.score))), fit)
        })
        .collect();
    page.picture("The worst fits", &figures::fits(&named));
    let row = |fit: &Fit| of_pair(fit.pair).next().map(|row| vec![row.name.clone(), row.label.clone()]);
    page.table("Where they are", &["pair", "file and trajectory"], &fits.iter().filter_map(row).collect::<Vec<_>>());
}

fn data(page: &mut Page, file: &FleetFile) {
    page.section("data", "Data and settings");
    let reasons: Vec<Vec<String>> =
        file.reasons.iter().map(|(reason, count)| vec![reason.clone(), count.to_string()]).collect();
    page.table("Without a result", &["why", "calibrations"], &reasons);
    let files: Vec<Vec<String>> =
        file.data.iter().map(|source| vec![source.path.clone(), source.sha256.chars().take(16).collect()]).collect();
    page.table("Files", &["file", "sha256"], &files);
    page.paragraph(&format!("Bounds: {}.", file.bounds_from));
    let searched = file.max_evaluations.map_or_else(
        || format!("{} simulations per parameter", file.evaluations_per_parameter),
        |most| format!("{most} simulations"),
    );
    page.paragraph(&format!(
        "Convention {}; optimizer {}, seed {}, at most {searched}; {}.",
        file.convention, file.optimizer, file.seed, file.program
    ));
}
