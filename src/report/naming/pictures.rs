//! Two pictures: planted effects against names, and the share named against the size.

use crate::bench::{DiagnosisReport, Judgement, judge};
use crate::report::figure::{Anchor, Figure, INK, PALE, PALETTE, Plot};
use std::collections::BTreeMap;

/// A cell \[px\].
const CELL: [f64; 2] = [26.0, 21.0];
/// Where the cells begin \[px\]: room for names on the left and above.
const LEFT: f64 = 190.0;
const TOP: f64 = 236.0;
/// Label of cases without a name.
const NO_NAME: &str = "no name";

/// The colour of a judgement, in the order of the legend.
const COLOURS: [(Judgement, &str, &str); 4] = [
    (Judgement::Right, "right", PALETTE[5]),
    (Judgement::InSet, "the truth in the set", PALETTE[2]),
    (Judgement::Silent, "silent", PALE),
    (Judgement::Wrong, "wrong", PALETTE[1]),
];

/// Confusion matrix: a row per effect planted alone, and per kind of drive without one; a column per name. A case with two names
/// counts in both columns.
#[must_use]
pub fn names(report: &DiagnosisReport) -> String {
    let mut cells: BTreeMap<(String, String), Vec<Judgement>> = BTreeMap::new();
    let mut sizes: BTreeMap<String, usize> = BTreeMap::new();
    for outcome in &report.outcomes {
        let judged = judge(outcome);
        if judged == Judgement::Failed || outcome.task.kind == "pair" {
            continue;
        }
        let row = outcome.task.planted();
        *sizes.entry(row.clone()).or_default() += 1;
        let none = [NO_NAME.to_owned()];
        for said in if outcome.adopted.is_empty() { &none[..] } else { &outcome.adopted } {
            cells.entry((row.clone(), said.clone())).or_default().push(judged);
        }
    }
    // Effects first, in alphabetical order, then labels in brackets.
    let mut rows: Vec<&String> = sizes.keys().collect();
    rows.sort_by_key(|row| (row.starts_with('('), *row));
    let mut columns: Vec<&String> = cells.keys().map(|(_, said)| said).collect();
    columns.sort_by_key(|said| (*said == NO_NAME, *said));
    columns.dedup();

    let width = (LEFT + CELL[0] * columns.len() as f64 + 60.0).max(760.0);
    let height = TOP + CELL[1] * rows.len() as f64 + 20.0;
    let line =
        "single effects and drives without any; rows: planted effects with their numbers of cases, columns: names";
    let mut figure = Figure::new(width, height, "Planted effects, and their names", &[line]);
    let legend: Vec<(&str, &str)> = COLOURS.iter().map(|(_, name, colour)| (*name, *colour)).collect();
    figure.legend([16.0, 72.0], &legend);
    let x = |column: usize| LEFT + 30.0 + CELL[0] * column as f64;
    let y = |row: usize| TOP + CELL[1] * row as f64;
    for (j, said) in columns.iter().enumerate() {
        figure.rising([x(j) + 0.6 * CELL[0], TOP - 8.0], 12.0, said);
        figure.line([x(j), TOP], [x(j), y(rows.len())], 0.6, PALE);
    }
    for (i, row) in rows.iter().enumerate() {
        figure.text([LEFT, y(i) + 15.0], 12.0, Anchor::End, INK, row);
        figure.text([LEFT + 24.0, y(i) + 15.0], 12.0, Anchor::End, "#777777", &sizes[*row].to_string());
        figure.line([LEFT + 30.0, y(i)], [x(columns.len()), y(i)], 0.6, PALE);
        for (j, said) in columns.iter().enumerate() {
            let Some(judged) = cells.get(&((*row).clone(), (*said).clone())) else { continue };
            let words = format!("{row} planted, {said}: {} of {}", judged.len(), sizes[*row]);
            figure.with_tooltip(&words, |figure| {
                let mut left = x(j) + 1.0;
                for (kind, _, colour) in COLOURS {
                    let share = judged.iter().filter(|judged| **judged == kind).count() as f64 / judged.len() as f64;
                    let right = left + share * (CELL[0] - 2.0);
                    if share > 0.0 {
                        figure.bar([left, y(i) + 1.0], [right, y(i) + CELL[1] - 1.0], colour, "none");
                    }
                    left = right;
                }
                figure.text([x(j) + 0.5 * CELL[0], y(i) + 15.0], 12.0, Anchor::Middle, INK, &judged.len().to_string());
            });
        }
    }
    figure.finish()
}

/// Power: share of single effects named right against their change of speed, for each base and all of them.
#[must_use]
pub fn power(report: &DiagnosisReport) -> String {
    const WIDTH: f64 = 760.0;
    let line = "single effects; root mean square change of the follower's speed [m/s]; bars: 95 % intervals";
    let mut figure = Figure::new(WIDTH, 360.0, "Share of effects that are named right, by their size", &[line]);
    let rows = &report.powers;
    let sizes = rows.first().map_or(&[][..], |row| &row.sizes);
    let legend: Vec<(&str, &str)> = rows.iter().zip(PALETTE).map(|(row, colour)| (row.of.as_str(), colour)).collect();
    figure.legend([16.0, 72.0], &legend);
    let plot = Plot::new([76.0, WIDTH - 20.0], [92.0, 316.0], 100.0);
    plot.axis(&mut figure, "named right [%]");
    for (k, at) in sizes.iter().enumerate() {
        let middle = plot.along(k, sizes.len(), 0.5);
        figure.text([middle, 334.0], 12.0, Anchor::Middle, INK, &at.rms_mps.to_string());
    }
    figure.text([0.5 * (plot.x[0] + plot.x[1]), 352.0], 12.5, Anchor::Middle, INK, "change of speed [m/s]");
    for (i, (row, colour)) in rows.iter().zip(PALETTE).enumerate() {
        let shift = (i as f64 - 0.5 * (rows.len() - 1) as f64) * 12.0;
        let shown: Vec<(usize, _)> = row.sizes.iter().enumerate().filter(|(_, at)| at.cases > 0).collect();
        let x = |k: usize| plot.along(k, sizes.len(), 0.5) + shift;
        let height = |count: usize, cases: usize| plot.height(100.0 * count as f64 / cases as f64);
        let line: Vec<[f64; 2]> = shown.iter().map(|(k, at)| [x(*k), height(at.right, at.cases)]).collect();
        figure.polyline(&line, 1.4, colour);
        for (k, at) in shown {
            let words = format!("{}, {} m/s: {} of {}", row.of, at.rms_mps, at.right, at.cases);
            figure.with_tooltip(&words, |figure| {
                let [low, high] = at.interval.map(|end| plot.height(100.0 * end));
                figure.line([x(k), low], [x(k), high], 1.4, colour);
                figure.dot([x(k), height(at.right, at.cases)], 3.4, colour);
            });
        }
    }
    figure.finish()
}
