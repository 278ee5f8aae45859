//! The report of a study as one HTML page: its figures, rankings, validation matrix, collisions and cost.

use super::super::html::{Page, escape, short};
use super::matrix::{Cross, Matrix, matrix};
use super::{Material, figures, tables};
use crate::statistics::{mean, median};
use crate::study::PastRuns;
use crate::study::inventory::Inventory;
use crate::study::outcome::claims::Claim;
use crate::study::outcome::{Outcomes, Ranking, Tried};
use crate::study::paper::VALIDATIONS;
use crate::study::part::Part;
use crate::study::table::{Table, Values};
use crate::text::shown::counted;
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

/// Largest number of named variants that cannot be distinguished.
const NAMED: usize = 4;

pub fn write(material: &Material, inventory: &Inventory, past: &PastRuns) -> String {
    let study = material.study;
    let mut page = Page::default();
    summary(&mut page, material);
    page.section("variants", "The variants");
    overall(&mut page, material);
    page.picture("Normalised calibration errors of the variants", &figures::boxes(material));
    page.section("vehicles", "Ranking per vehicle");
    page.picture("Calibration errors by platoon and vehicle", &figures::trajectories(material));
    rankings(&mut page, material.own);
    page.section("validation", "Validation");
    let matrix = matrix(inventory, &material.own.gof);
    validation(&mut page, &matrix);
    page.picture("Collisions in validation", &figures::collisions(material));
    claims(&mut page, material);
    page.section("replicates", "Replicates");
    page.picture("Coefficient of variation over replicates", &figures::variations(material));
    page.section("cost", "Compute used");
    cost(&mut page, material, inventory, past);
    page.section("data", "The data");
    data(&mut page, material);
    let missing = match material.missing {
        0 => String::new(),
        n => format!(" {n} tasks are missing, so these numbers are preliminary."),
    };
    let own = material.own;
    let (first, then) = answer(own, &Ranking::of(own, &|_| true));
    let lead =
        format!("<p class=\"verdict\"><strong>{}</strong> {}{}</p>", escape(&first), escape(&then), escape(&missing));
    page.finish(&format!("Study {}", study.name), &lead, &twin(material, &matrix, past), None)
}

/// The variant with the lowest error on unseen trajectories, and the one that fits its own best.
pub(super) fn answer(own: &Outcomes, ranking: &Ranking) -> (String, String) {
    let scored = (0..own.variants.len()).filter_map(|v| Some((v, own.mean_score(v, &|_| true)?)));
    let Some((best, lowest)) = scored.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return ("No variant has a score on every trajectory.".to_owned(), String::new());
    };
    let count = own.drives.len();
    let mean = if count == 1 { "".to_owned() } else { format!(" in the mean over {count} trajectories") };
    let fits = format!("{} {}{mean}", own.gof, short(lowest));
    let nested = "on its own trajectories the larger of two nested variants always fits better";
    let Some(chosen) = ranking.chosen.filter(|_| ranking.unseen) else {
        return (
            format!("{} fits its own trajectories best.", own.variants[best]),
            format!("{fits}. No variant was validated, and {nested}."),
        );
    };
    let name = &own.variants[chosen];
    let open: Vec<String> = ranking.open().iter().map(|v| own.variants[*v].name()).collect();
    let first = match open.len() {
        0 if own.variants.len() == 1 => format!("{name} was validated on unseen drives."),
        0 => format!("{name} has the lowest error on unseen drives."),
        n => {
            let more = if n > NAMED { format!(" and {} more", n - NAMED) } else { String::new() };
            format!(
                "{name} cannot be distinguished from {}{more} on unseen drives, and none of them has fewer parameters.",
                open[..n.min(NAMED)].join(", ")
            )
        }
    };
    let unseen = median(&validated(own, chosen, &|_| true).0);
    let mut then = format!("Median NRMSE(s,v,a) there {}.", optional(unseen));
    if own.variants.len() > 1 {
        then += &format!(" {} fits its own drives best, {fits}; {nested}.", own.variants[best]);
    }
    (first, then)
}

fn summary(page: &mut Page, material: &Material) {
    let (study, own) = (material.study, material.own);
    page.section("summary", "In short");
    let size = format!(
        "{} variants on {} trajectories, {} replicates each, scored by {}",
        own.variants.len(),
        own.drives.len(),
        study.replicates,
        own.gof
    );
    let judged = material.judged();
    let agree = judged.iter().filter(|claim| claim.agrees == Some(true)).count();
    let claims = format!("of its statements {agree} agree, {} differ", judged.len() - agree);
    let settings = format!(
        "at most {} simulations per calibration by {}, seed {}, convention {}, {}",
        study.max_evaluations, study.optimizer, study.seed, study.convention, study.program
    );
    let mut facts = vec![("what was compared", size), ("beside the paper", claims), ("settings", settings)];
    facts.retain(|(what, _)| !judged.is_empty() || *what != "beside the paper");
    let list: String = facts.iter().map(|(k, v)| format!("<dt>{k}</dt><dd>{}</dd>", escape(v))).collect();
    page.raw(&format!("<dl>{list}</dl>"));
}

fn claims(page: &mut Page, material: &Material) {
    let judged = material.judged();
    if judged.is_empty() {
        return;
    }
    page.section("paper", "Where it agrees with the paper, and where not");
    let row = |claim: &&Claim| {
        let mark = if claim.agrees == Some(true) { "agrees" } else { "differs" };
        vec![mark.to_owned(), claim.paper.to_owned(), claim.found.clone(), claim.why.clone().unwrap_or_default()]
    };
    let rows: Vec<Vec<String>> = judged.iter().map(row).collect();
    let head = ["verdict", "the paper says", "this study", "reason for a difference"];
    page.table("Statements of the paper", &head, &rows);
    material.open().iter().for_each(|open| page.paragraph(open));
}

fn optional(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), short)
}

fn signed(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| format!("{value:+.0}"))
}

/// Scores of all validation runs of a variant that reached the end.
fn validated(own: &Outcomes, variant: usize, wanted: &dyn Fn(usize) -> bool) -> (Vec<f64>, usize, usize) {
    let cells = own.cells[variant].iter().enumerate().filter(|(drive, _)| wanted(*drive));
    let tried: Vec<&Tried> = cells.flat_map(|(_, cell)| &cell.tried).collect();
    let scores = tried.iter().filter_map(|tried| tried.score());
    let collisions = tried.iter().filter(|tried| ***tried == Tried::Collision).count();
    (scores.collect(), collisions, tried.len())
}

/// Tables 4 and 5 in one, beside the paper's numbers.
fn overall(page: &mut Page, material: &Material) {
    let own = material.own;
    let ranking = Ranking::of(own, &|_| true);
    let mut rows: Vec<Vec<String>> = ranking
        .order
        .iter()
        .map(|&v| {
            let variant = &own.variants[v];
            let (four, paper) = (&material.four[v], material.printed(variant));
            let (scores, collisions, runs) = validated(own, v, &|_| true);
            vec![
                variant.name(),
                variant.shown_id(),
                optional(own.mean_score(v, &|_| true)),
                optional(four.median),
                optional(paper.map(|p| p.median)),
                signed(four.change),
                signed(paper.and_then(|p| p.change)),
                optional(median(&scores)),
                ranking.behind[v].map_or("–".to_owned(), |behind| behind.in_words()),
                format!("{collisions} of {runs}"),
                paper.map_or("–".to_owned(), |p| format!("{} of {VALIDATIONS}", p.collisions)),
            ]
        })
        .collect();
    let score_name = format!("mean {}", own.gof);
    let mut head = vec![
        "variant",
        "id",
        &score_name,
        "median share above the best",
        "paper",
        "change of this share against the base [%]",
        "paper",
        "median NRMSE(s,v,a) in validation",
        "mean in validation is higher by [95 %]",
        "collisions",
        "paper",
    ];
    let mut caption = format!("All variants, the lowest error {} first", by(&ranking));
    if material.is_beside_paper() {
        caption += ", beside the paper's Tables 4 and 5";
    } else {
        let of_study: Vec<bool> = head.iter().map(|name| *name != "paper").collect();
        for row in &mut rows {
            let mut own = of_study.iter();
            row.retain(|_| own.next() == Some(&true));
        }
        head.retain(|name| *name != "paper");
    }
    page.table(&caption, &head, &rows);
}

/// Measure of a ranking.
fn by(ranking: &Ranking) -> &'static str {
    if ranking.unseen { "in validation" } else { "in calibration" }
}

fn rankings(page: &mut Page, own: &Outcomes) {
    let vehicles: BTreeSet<&str> = own.drives.iter().map(|drive| drive.vehicle.as_str()).collect();
    for vehicle in vehicles {
        let is_own = |drive: usize| own.drives[drive].vehicle == vehicle;
        let drives: Vec<usize> = (0..own.drives.len()).filter(|d| is_own(*d)).collect();
        let ranking = Ranking::of(own, &is_own);
        let rows: Vec<Vec<String>> = ranking
            .order
            .iter()
            .enumerate()
            .map(|(rank, &v)| {
                let errors = |k: usize| {
                    let values = drives.iter().filter_map(|&d| Some(own.cells[v][d].best?[k]));
                    optional(mean(&values.collect::<Vec<_>>()))
                };
                let (scores, collisions, runs) = validated(own, v, &is_own);
                vec![
                    own.variants[v].name(),
                    (rank + 1).to_string(),
                    optional(own.mean_score(v, &is_own)),
                    errors(0),
                    errors(1),
                    errors(2),
                    optional(median(&scores)),
                    ranking.behind[v].map_or("–".to_owned(), |behind| behind.in_words()),
                    format!("{collisions} of {runs}"),
                ]
            })
            .collect();
        let score_name = format!("mean {}", own.gof);
        let head = [
            "variant",
            "rank",
            &score_name,
            "RMSE(s) [m]",
            "RMSE(v) [m/s]",
            "RMSE(a) [m/s²]",
            "median NRMSE(s,v,a) in validation",
            "mean in validation is higher by [95 %]",
            "collisions",
        ];
        let count = counted(drives.len(), "trajectory");
        page.table(&format!("{vehicle}, {count}, ranked {}", by(&ranking)), &head, &rows);
    }
}

fn validation(page: &mut Page, matrix: &Matrix) {
    page.paragraph(
        "Calibrated on the trajectory of the row, simulated on that of the column: median NRMSE(s,v,a) over the variants, and collisions. \
         The diagonal shows the calibration itself.",
    );
    let name = |place: &(String, usize)| format!("{} follower {}", place.0, place.1);
    for (vehicle, rows) in matrix {
        let places: BTreeSet<&(String, usize)> = rows.keys().chain(rows.values().flat_map(|row| row.keys())).collect();
        let cell = |cross: Option<&Cross>| {
            cross.map_or("–".to_owned(), |cross| {
                let collisions = match cross.collisions {
                    0 => String::new(),
                    n => format!(", {n} of {} collide", cross.runs),
                };
                format!("{}{collisions}", optional(cross.median()))
            })
        };
        let mut lines: Vec<Vec<String>> = Vec::new();
        for (from, to) in rows {
            let cells = places.iter().map(|place| cell(to.get(*place)));
            lines.push(std::iter::once(name(from)).chain(cells).collect());
        }
        let names: Vec<String> = places.iter().map(|place| name(place)).collect();
        let head: Vec<&str> = std::iter::once("calibrated on").chain(names.iter().map(String::as_str)).collect();
        page.table(vehicle, &head, &lines);
    }
}

fn cost(page: &mut Page, material: &Material, inventory: &Inventory, past: &PastRuns) {
    let done = inventory.done();
    let evaluations: u64 = inventory.parts.iter().flatten().map(|part| part.calibration.evaluations).sum();
    let evaluator = |part: &Part| {
        let row = &part.calibration;
        format!("{} ({}) on {}", row.evaluator, row.precision, row.adapter.as_deref().unwrap_or("CPU"))
    };
    let evaluators: BTreeSet<String> = inventory.parts.iter().flatten().map(evaluator).collect();
    page.paragraph(&format!(
        "{done} calibrations are finished, {} are missing, {} found no feasible candidate; {evaluations} simulations; {}.",
        material.missing,
        inventory.failed(),
        Vec::from_iter(evaluators).join(", ")
    ));
    if past.runs > 0 {
        let rate = past.evaluations as f64 / past.wall_s.max(1e-9);
        page.paragraph(&format!(
            "Recorded by {} on this folder: {} tasks in {:.0} s of wall time (runs at the same time count each) and {:.0} s of CPU time, \
             {} simulations per second of wall time.",
            if past.runs == 1 { "one run".to_owned() } else { format!("{} runs", past.runs) },
            past.tasks,
            past.wall_s,
            past.cpu_s,
            short(rate)
        ));
    }
}

fn data(page: &mut Page, material: &Material) {
    let row = |drive: &crate::study::drive::DriveEntry| {
        vec![
            drive.label(),
            drive.vehicle.clone(),
            drive.file.clone(),
            format!("{:.1} to {:.1}", drive.window_s[0], drive.window_s[1]),
            drive.samples.to_string(),
            drive.notes.join("; "),
            drive.sha256.chars().take(16).collect(),
        ]
    };
    let rows: Vec<Vec<String>> = material.study.drives.iter().map(row).collect();
    let head = ["trajectory", "vehicle", "file", "window [s]", "samples", "prepared", "sha256"];
    page.table("Trajectories", &head, &rows);
}

/// The numbers of the page for programs.
fn twin(material: &Material, matrix: &Matrix, past: &PastRuns) -> String {
    let claims: Vec<Value> = material
        .claims
        .iter()
        .map(|claim| json!({"paper": claim.paper, "found": claim.found, "agrees": claim.agrees, "why": claim.why}))
        .collect();
    let crosses: Vec<Value> = matrix
        .iter()
        .flat_map(|(vehicle, rows)| rows.iter().map(move |(from, to)| (vehicle, from, to)))
        .flat_map(|(vehicle, from, to)| {
            to.iter().map(move |(place, cross)| {
                json!({"vehicle": vehicle, "calibrated_on": from.0, "calibrated_follower": from.1, "simulated_on": place.0,
                       "simulated_follower": place.1, "median_nrmse_sva": cross.median(), "collisions": cross.collisions, "runs": cross.runs})
            })
        })
        .collect();
    let json = json!({
        "schema_version": crate::study::SCHEMA_VERSION,
        "study": material.study,
        "missing_tasks": material.missing,
        "claims": claims,
        "table4": rows(&tables::four(material)),
        "table5": rows(&tables::five(material)),
        "figure4": rows(&tables::variations(material)),
        "figure5": rows(&tables::trajectories(material)),
        "figure6": rows(&tables::boxes(material)),
        "figure7": rows(&tables::collisions(material)),
        "validation_matrix": crosses,
        "compute": {"runs": past.runs, "tasks": past.tasks, "wall_s": past.wall_s, "cpu_s": past.cpu_s,
                    "evaluations": past.evaluations},
    });
    serde_json::to_string(&json).expect("numbers and text can be written")
}

/// One object per row of a table.
fn rows(table: &Table) -> Value {
    let value = |values: &Values, row: usize| match values {
        Values::Integer(values) => json!(values[row]),
        Values::Number(values) => json!(values[row].filter(|x| x.is_finite())),
        Values::Flag(values) => json!(values[row]),
        Values::Text(values) => json!(values[row]),
    };
    let row = |i: usize| {
        let cells = table.columns.iter().map(|column| (column.name.clone(), value(&column.values, i)));
        Value::Object(cells.collect::<Map<String, Value>>())
    };
    Value::Array((0..table.rows()).map(row).collect())
}
