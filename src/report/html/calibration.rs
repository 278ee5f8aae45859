//! The report of a calibration: model and data, quality of the fit, parameters.

use super::budget::budget;
use super::sumo::sumo;
use super::{Chart, MadeBy, Page, between, drives, escape, short, within};
use crate::diagnose::describe::error_breakdown::Budget;
use crate::identify::CONFIDENCE;
use crate::report::own;
use crate::report::panel::{Panel, Series, Style};
use crate::report::text::{OPEN, UNDETERMINED, faults, partner, scores_in_words};
use crate::result::{KnowledgeEntry, ResultFile};
use crate::sumo::Export;

/// Errors of the simulations of a calibration.
#[derive(Debug)]
pub struct DriveErrors {
    /// Of all compared samples together.
    pub all: Budget,
    /// Name of each drive, and its root mean square error of spacing \[m\], speed \[m/s\] and acceleration \[m/s²\].
    pub each: Vec<(String, [f64; 3])>,
}

/// One HTML file. `charts` are the simulations, trajectory by trajectory, `errors` their errors, `exported` the comparison with SUMO,
/// with charts; `twin` is the text of result.json.
pub fn calibration(
    result: &ResultFile,
    charts: Vec<Chart>,
    errors: Option<&DriveErrors>,
    exported: Option<(Export, Vec<Chart>)>,
    twin: &str,
    made: Option<&MadeBy>,
) -> String {
    let mut page = Page::default();
    page.section("parameters", "Parameters");
    parameters(&mut page, result);
    scores(&mut page, result, errors);
    page.section("simulation", "Observed against simulated");
    if charts.is_empty() {
        page.paragraph("The folder has no simulation of this result, so there is no chart.");
    }
    page.charts("Observed and simulated", "show", charts);
    if let Some(errors) = errors {
        page.section("errors", "When errors occur");
        budget(&mut page, &errors.all, "Error of the simulation");
    }
    page.section("replicates", "Replicates and convergence");
    let rows: Vec<Vec<String>> = result
        .replicates
        .iter()
        .map(|r| {
            let score = r.score.map_or("–".to_owned(), |score| format!("{score:.6}"));
            vec![r.replicate.to_string(), score, r.evaluations.to_string(), r.stop.to_string()]
        })
        .collect();
    page.table("Replicates", &["replicate", "score", "evaluations", "ended"], &rows);
    spread(&mut page, result);
    let convergence = |replicate: &crate::result::ReplicateEntry| {
        let (x, y): (Vec<f64>, Vec<f64>) =
            replicate.convergence.iter().map(|(evaluations, score)| (*evaluations as f64, *score)).unzip();
        Chart {
            title: replicate.replicate.to_string(),
            x_label: "evaluations".to_owned(),
            x,
            points: false,
            panels: vec![Panel::new(&result.gof, vec![Series::new("best so far", Style::Simulated, y)])],
        }
    };
    let converging = result.replicates.iter().filter(|r| r.convergence.len() > 1);
    page.charts("Best score over evaluations", "replicate", converging.map(convergence).collect());
    fitted(&mut page, result);
    if let Some((export, charts)) = exported {
        sumo(&mut page, &export, charts);
    }
    // The replicates score the common law.
    let of_drivers = result.per_drive.as_ref().filter(|_| result.own.is_some());
    let score = of_drivers.map_or(result.best_score(), |scores| scores.pooled.or(scores.mean));
    let lead = format!(
        "<p class=\"verdict\"><strong>{}</strong> (root mean square, and its share of that of the measured signal) with variant {}; {} = {}.</p>",
        escape(&headline(result, errors)),
        escape(&result.numbered_model()),
        escape(&result.gof),
        score.map_or("–".to_owned(), short),
    );
    // The warnings of the command say the same with the remedies.
    let is_new = |told: &str| !made.is_some_and(|made| made.warnings.iter().any(|warning| warning.contains(told)));
    let box_of = |title: &str, told: &str| {
        format!("<p class=\"verdict bad_base\"><strong>{title}.</strong> {}.</p>", escape(told))
    };
    let faults: String = faults(&result.data)
        .iter()
        .filter(|(finding, ..)| is_new(&finding.sentence))
        .map(|(_, on, told)| box_of(&format!("A fault of the data{}", escape(on)), told))
        .collect();
    let warning = result.drivers.as_ref().filter(|told| is_new(told));
    let warning = warning.map_or(String::new(), |told| box_of("Not one driver", told));
    let on = drives(result.data.iter().map(|data| (data.path.as_str(), data.name.as_str())));
    page.finish(&format!("Calibration of {}{on}", result.model()), &format!("{lead}{faults}{warning}"), twin, made)
}

/// Errors of the simulation, in the units of the signals and in per cent of their size.
fn headline(result: &ResultFile, errors: Option<&DriveErrors>) -> String {
    let shares = ["nrmse_s", "nrmse_v", "nrmse_a"].map(|name| result.score.get(name).copied().flatten());
    let errors = off(result, errors);
    let told = |k: usize, unit: &str| {
        let share = shares[k].map_or(String::new(), |share| format!(" ({} %)", two(100.0 * share)));
        errors[k].map(|error| format!("{} {unit}{share}", two(error)))
    };
    match (told(0, "m"), told(1, "m/s"), told(2, "m/s²")) {
        (Some(s), Some(v), Some(a)) => format!("Spacing is off by {s}, speed by {v} and acceleration by {a}"),
        _ => "The simulation cannot be compared in every signal".to_owned(),
    }
}

/// Two significant digits.
fn two(value: f64) -> String {
    let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    short(rounded)
}

/// Root mean square errors of all drives: of their samples together if these are available, as in the budget, otherwise as scored.
fn off(result: &ResultFile, errors: Option<&DriveErrors>) -> [Option<f64>; 3] {
    match errors.filter(|errors| errors.each.len() == result.data.len()) {
        Some(errors) => errors.all.rms.map(Some),
        None => ["rmse_s", "rmse_v", "rmse_a"].map(|name| result.score.get(name).copied().flatten()),
    }
}

/// The measures, and the errors of each drive if there are several.
fn scores(page: &mut Page, result: &ResultFile, errors: Option<&DriveErrors>) {
    let shown = |value: Option<f64>| value.map_or("–".to_owned(), short);
    let several = if result.data.len() > 1 { ", mean over the drives" } else { "" };
    let row = |(name, keys): (&str, [&str; 4])| -> Vec<String> {
        let values = keys.map(|key| shown(result.score.get(key).copied().flatten()));
        std::iter::once(format!("{name}{several}")).chain(values).collect()
    };
    let mut rows =
        [("NRMSE", ["nrmse_s", "nrmse_v", "nrmse_a", "nrmse_sva"]), ("Theil's U", ["u_s", "u_v", "u_a", "u_sva"])]
            .map(row)
            .to_vec();
    let rmse = |name: String, values: [Option<f64>; 3]| -> Vec<String> {
        std::iter::once(name).chain(values.map(shown)).chain(["–".to_owned()]).collect()
    };
    rows.push(rmse("RMSE [m, m/s, m/s²]".to_owned(), off(result, errors)));
    let each = errors.iter().flat_map(|errors| &errors.each).filter(|_| !several.is_empty());
    rows.extend(each.map(|(name, values)| rmse(format!("RMSE of {name}"), values.map(Some))));
    page.table("How well", &["measure", "spacing", "speed", "acceleration", "sum"], &rows);
    for (name, scores) in [("Drives", &result.per_drive), ("Held back", &result.held_back)] {
        scores.iter().for_each(|scores| page.paragraph(&format!("{}.", scores_in_words(name, scores, &result.gof))));
    }
}

/// Model, data and settings.
fn fitted(page: &mut Page, result: &ResultFile) {
    page.section("fit", "Model and data");
    let rows: Vec<Vec<String>> = result
        .data
        .iter()
        .map(|d| {
            vec![
                d.path.clone(),
                format!("{} {}", d.follower, d.name),
                format!("{:.1} to {:.1}", d.window_s[0], d.window_s[1]),
                d.samples.to_string(),
                d.preparation.join("; "),
                d.sha256.chars().take(16).collect(),
            ]
        })
        .collect();
    page.table("Data", &["file", "follower", "window [s]", "samples", "prepared", "sha256"], &rows);
    let device = result.adapter.clone().unwrap_or_else(|| "CPU".to_owned());
    page.paragraph(&format!(
        "Convention {}; evaluator {} ({}) on {device}; optimizer {}, seed {}, {} evaluations; {}.",
        result.convention,
        result.evaluator,
        result.precision,
        result.optimizer,
        result.seed,
        result.evaluations,
        result.program
    ));
}

/// Values, bounds, and intervals.
fn parameters(page: &mut Page, result: &ResultFile) {
    let known = |name: &String| result.identifiability.as_ref().and_then(|known| known.parameters.get(name));
    let correlation = result.identifiability.as_ref().and_then(|known| known.correlation.as_ref());
    let row = |(name, value): (&String, &f64)| {
        let own = result.intervals.get(name).copied();
        let digits = |value: f64| own.map_or_else(|| short(value), |ends| within(value, ends));
        let end = |value: f64, open: bool| if open { format!("({})", digits(value)) } else { digits(value) };
        let interval = match (own, known(name)) {
            (_, Some(KnowledgeEntry { determined: false, .. })) => UNDETERMINED.to_owned(),
            (Some([lower, upper]), Some(KnowledgeEntry { open, .. })) => {
                format!("{} to {}", end(lower, open[0]), end(upper, open[1]))
            }
            (interval, _) => between(interval),
        };
        let bounds = match result.bounds.get(name) {
            Some([lower, upper]) if lower == upper => "fixed".to_owned(),
            bounds => between(bounds.copied()),
        };
        vec![
            name.clone(),
            digits(*value),
            interval,
            result.units.get(name).cloned().unwrap_or_default(),
            bounds,
            known(name).map_or("–".to_owned(), |known| format!("{:.0}", known.effective_samples)),
            correlation.and_then(|correlation| partner(correlation, name)).unwrap_or_default(),
            result.meaning(name).to_owned(),
            if result.at_bound.contains(name) { "at its bound" } else { "" }.to_owned(),
        ]
    };
    let rows: Vec<Vec<String>> = result.parameters.iter().map(row).collect();
    let confidence = result.identifiability.as_ref().map_or(CONFIDENCE, |known| known.confidence);
    let interval = format!("{:.0} % interval", 100.0 * confidence);
    let head = [
        "parameter",
        "value",
        &interval,
        "unit",
        "bounds",
        "eff. samples",
        "goes with (correlation)",
        "meaning",
        "warning",
    ];
    page.table("Calibrated parameters", &head, &rows);
    if result.own.is_some() {
        page.table("Own parameters of the drivers, whose middle is above", &own::HEAD, &own::rows(result));
    }
    if let Some(from) = &result.bounds_from {
        page.paragraph(&format!("Bounds: {from}."));
    }
    let fixed = result.bounds.iter().filter(|(_, [lower, upper])| lower == upper).map(|(name, _)| name.as_str());
    let fixed: Vec<&str> = fixed.collect();
    if !fixed.is_empty() {
        page.paragraph(&format!("Fixed, so not calibrated: {}.", fixed.join(", ")));
    }
    if result.parameters.keys().filter_map(known).any(|known| known.determined && known.open != [false; 2]) {
        page.paragraph(&format!("{interval}, {OPEN}."));
    }
}

/// Spread of the replicates' best candidates.
fn spread(page: &mut Page, result: &ResultFile) {
    if let Some(cv) = result.cv {
        page.paragraph(&format!("Coefficient of variation of the score over the replicates: {} %.", short(100.0 * cv)));
    }
    let ranges = result.identifiability.iter().flat_map(|known| &known.replicate_range);
    let row = |(name, range): (&String, &[f64; 2])| {
        let bounds = result.bounds.get(name).copied();
        let share = bounds.map(|[low, high]| (range[1] - range[0]) / (high - low)).filter(|share| share.is_finite());
        let share = share.map_or("–".to_owned(), |share| format!("{:.1} %", 100.0 * share));
        vec![name.clone(), between(Some(*range)), result.units.get(name).cloned().unwrap_or_default(), share]
    };
    let head = ["parameter", "over the replicates", "unit", "share of the range searched"];
    page.table("Spread of the replicates' best candidates", &head, &ranges.map(row).collect::<Vec<_>>());
    if let Some(note) = result.identifiability.as_ref().and_then(|known| known.note.as_ref()) {
        page.paragraph(note);
    }
}
