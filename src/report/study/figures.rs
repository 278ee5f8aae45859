//! Figures 4 to 7.

use super::super::figure::{Anchor, Figure, INK, PALETTE, PAPER, Plot};
use super::Material;
use crate::catalog::{BASES, Base, Variant};
use crate::statistics::{box_statistics, mean, quantile};
use crate::study::outcome::Outcomes;
use crate::study::paper::VALIDATIONS;
use crate::text::shown::counted;

const WIDTH: f64 = 1100.0;
const LEFT: f64 = 76.0;
const RIGHT: f64 = WIDTH - 20.0;

/// Those of Table 1 have the same colour in all studies.
fn colour(own: &Outcomes, base: &Base) -> &'static str {
    let of_table = BASES.iter().position(|known| known == base);
    let of_study = || own.bases().iter().filter(|known| !BASES.contains(known)).position(|known| known == base);
    let index = of_table.or_else(|| Some(BASES.len() + of_study()?)).unwrap_or(0);
    PALETTE[index % PALETTE.len()]
}

fn legend(own: &Outcomes) -> Vec<(&'static str, &'static str)> {
    own.bases().into_iter().map(|base| (base.paper, colour(own, &base))).collect()
}

/// Figure 4: histograms of the coefficient of variation.
pub fn variations(material: &Material) -> String {
    let own = material.own;
    let bases = own.bases();
    let count: usize = (0..own.variants.len()).map(|v| own.variations(v).len()).sum();
    let line = format!(
        "{count} values, each of one variant on one trajectory: standard deviation over mean of the replicates' scores. λ: 1/mean, as of \
         an exponential distribution."
    );
    let title = "Figure 4: coefficient of variation of the optimum over replicates";
    let mut figure = Figure::new(WIDTH, 392.0, title, &[&line]);
    let of = |base: &Base| -> Vec<f64> {
        own.class(base.name).into_iter().flat_map(|v| own.variations(v)).map(|cv| 100.0 * cv).collect()
    };
    let all: Vec<f64> = bases.iter().flat_map(of).collect();
    if all.is_empty() {
        figure.text([WIDTH / 2.0, 220.0], 14.0, Anchor::Middle, INK, "no variant has two replicates on a trajectory");
        return figure.finish();
    }
    // Bars of equal width up to the largest value; a few outliers must not flatten the rest.
    let most = all.iter().copied().fold(0.0, f64::max);
    let last = quantile(&all, 0.98).map_or(1.0, |q| if most > 2.0 * q { q } else { most }).max(1e-6);
    let end = Plot::new([0.0; 2], [0.0; 2], last).top;
    const BARS: usize = 16;
    let gap = 62.0;
    let width = (RIGHT - LEFT + gap) / bases.len().max(1) as f64;
    for (i, base) in bases.iter().enumerate() {
        let values = of(base);
        let left = LEFT + i as f64 * width;
        let mut counts = [0usize; BARS];
        for cv in &values {
            counts[((cv / end * BARS as f64) as usize).min(BARS - 1)] += 1;
        }
        let share = |count: usize| 100.0 * count as f64 / values.len().max(1) as f64;
        let highest = counts.iter().map(|count| share(*count)).fold(0.0, f64::max);
        let plot = Plot::new([left, left + width - gap], [118.0, 330.0], highest);
        plot.axis(&mut figure, if i == 0 { "share of all [%]" } else { "" });
        for (k, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            let (x, to_x) = (plot.along(k, BARS, 0.06), plot.along(k, BARS, 0.94));
            let [from, to] = [k, k + 1].map(|edge| short(end * edge as f64 / BARS as f64));
            let beyond = if k + 1 == BARS && most > end { " and above" } else { "" };
            let text = format!("{}: {count} of {} with CV {from} to {to} %{beyond}", base.paper, values.len());
            figure.with_tooltip(&text, |figure| {
                figure.bar([x, plot.height(share(*count))], [to_x, plot.y[1]], colour(own, base), "none");
            });
        }
        for k in 0..=2 {
            let x = plot.along(k, 2, 0.0);
            let at = end * k as f64 / 2.0;
            let exact = |digits: &usize| {
                let scale = 10f64.powi(*digits as i32);
                ((at * scale).round() / scale - at).abs() < 1e-6 * end
            };
            let digits = (0..4).find(exact).unwrap_or(4);
            let text = if end < 0.01 { short(at) } else { format!("{at:.digits$}") };
            let above = if k == 2 && most > end { "≥ " } else { "" };
            // The last one ends with the bars, next to another panel or the edge.
            let anchor = if k == 2 { Anchor::End } else { Anchor::Middle };
            figure.text([x, 348.0], 11.5, anchor, INK, &format!("{above}{text}"));
        }
        figure.legend([left, 84.0], &[(base.paper, colour(own, base))]);
        let rate = mean(&values).filter(|mean| *mean > 0.0).map_or("-".to_owned(), |mean| short(100.0 / mean));
        let worst = short(values.iter().copied().fold(0.0, f64::max));
        figure.text([left, 102.0], 11.5, Anchor::Start, INK, &format!("max {worst} %, λ {rate}"));
        figure.text([(plot.x[0] + plot.x[1]) / 2.0, 370.0], 12.5, Anchor::Middle, INK, "CV [%]");
    }
    figure.finish()
}

/// A number in few characters.
fn short(x: f64) -> String {
    match x {
        0.0 => "0".to_owned(),
        _ if !(0.01..10_000.0).contains(&x) => format!("{x:.0e}"),
        _ if x < 100.0 => format!("{x:.2}"),
        _ => format!("{x:.0}"),
    }
}

/// Figure 5: scores of the base models by trajectory, with the best and worst of all variants if there are others.
pub fn trajectories(material: &Material) -> String {
    let own = material.own;
    let mut platoons: Vec<&str> = own.drives.iter().map(|d| d.platoon.as_str()).collect();
    platoons.dedup();
    let (row, per_row) = (240.0, 2);
    let rows = platoons.len().div_ceil(per_row);
    let bases = own.bases();
    let has_others = own.variants.iter().any(|variant| !bases.iter().any(|base| base.name == variant.name()));
    let ends =
        format!(" White and gold: the lowest and highest among all {} variants of the study.", own.variants.len());
    let line = format!("Scores ({}) after calibration.{}", own.gof, if has_others { &ends } else { "" });
    let mut figure =
        Figure::new(WIDTH, 96.0 + row * rows as f64, "Figure 5: calibration errors by platoon and vehicle", &[&line]);
    let mut entries = legend(own);
    if has_others {
        entries.insert(0, ("lowest", "white"));
        entries.push(("highest", "#f0c800"));
    }
    figure.legend([LEFT, 76.0], &entries);
    if has_others {
        figure.bar([LEFT, 67.0], [LEFT + 10.0, 77.0], "white", INK);
    }
    let highest = (0..own.drives.len()).filter_map(|d| own.range(d)).map(|range| range[1]).fold(0.0, f64::max);
    for (k, platoon) in platoons.iter().enumerate() {
        let width = (RIGHT - LEFT + 70.0) / per_row as f64;
        let left = LEFT + (k % per_row) as f64 * width;
        let top = 112.0 + (k / per_row) as f64 * row;
        let plot = Plot::new([left, left + width - 70.0], [top, top + row - 76.0], highest);
        plot.axis(&mut figure, if k % per_row == 0 { "score" } else { "" });
        figure.text([left + 6.0, top - 2.0], 14.0, Anchor::Start, INK, platoon);
        let drives: Vec<usize> = (0..own.drives.len()).filter(|d| own.drives[*d].platoon == *platoon).collect();
        for (place, &drive) in drives.iter().enumerate() {
            let base = |base: &Base| {
                let index = own.variants.iter().position(|v| v.name() == base.name)?;
                Some((own.cells[index][drive].score?, colour(own, base), base.paper))
            };
            let range = own.range(drive);
            let mut bars: Vec<Option<(f64, &str, &str)>> = bases.iter().map(base).collect();
            if has_others {
                bars.insert(0, range.map(|range| (range[0], "white", "lowest")));
                bars.push(range.map(|range| (range[1], "#f0c800", "highest")));
            }
            let count = bars.len();
            let name = &own.drives[drive].vehicle;
            for (i, (score, fill, what)) in bars.into_iter().enumerate().filter_map(|(i, bar)| Some((i, bar?))) {
                let x = |share: f64| plot.along(place, drives.len(), 0.08 + 0.84 * (i as f64 + share) / count as f64);
                figure.with_tooltip(&format!("{platoon} {name}, {what}: {score:.4}"), |figure| {
                    figure.bar([x(0.05), plot.height(score)], [x(0.95), plot.y[1]], fill, INK);
                });
            }
            figure.text([plot.along(place, drives.len(), 0.5), plot.y[1] + 17.0], 12.0, Anchor::Middle, INK, name);
        }
    }
    figure.finish()
}

/// Positions of the variants along x: the classes side by side, with a gap.
fn positions(own: &Outcomes, plot: &Plot) -> (Vec<f64>, f64) {
    let bases = own.bases();
    let unit = unit(own);
    let mut x = vec![0.0; own.variants.len()];
    let mut place = 0.0;
    for base in &bases {
        for variant in own.class(base.name) {
            x[variant] = plot.x[0] + (place + 0.5) * unit;
            place += 1.0;
        }
        place += GAP;
    }
    (x, unit)
}

/// Between classes, in variants.
const GAP: f64 = 1.0;
/// Width of a letter below the variants.
const LETTER: f64 = 6.5;

/// Width of a variant.
fn unit(own: &Outcomes) -> f64 {
    let total = own.variants.len() as f64 + GAP * (own.bases().len() as f64 - 1.0);
    (RIGHT - LEFT) / total.max(1.0)
}

/// Labels below the variants: their names if there is room for them, otherwise ids of Table 1.
fn labels(own: &Outcomes) -> Vec<String> {
    let names: Vec<String> = own.variants.iter().map(ToString::to_string).collect();
    if longest(&names) <= unit(own) {
        return names;
    }
    // A law has no id.
    own.variants.iter().zip(names).map(|(v, name)| if v.id() == 0 { name } else { v.shown_id() }).collect()
}

fn longest(labels: &[String]) -> f64 {
    LETTER * labels.iter().map(|label| label.chars().count()).max().unwrap_or(0) as f64
}

/// Meaning of the numbers below the variants, if any.
fn what_labels_are(own: &Outcomes) -> &'static str {
    let is_id = |label: &String| label.parse::<u32>().is_ok();
    if labels(own).iter().any(is_id) { "Numbers below: ids of Table 1." } else { "" }
}

/// A variant in words, with its id, if any.
fn called(variant: &Variant) -> String {
    match variant.id() {
        0 => variant.to_string(),
        id => format!("{id} {variant}"),
    }
}

/// Labels below, as many as there is room for, and names of the classes.
fn ids(figure: &mut Figure, own: &Outcomes, plot: &Plot, x: &[f64], unit: f64) {
    let labels = labels(own);
    let every = (longest(&labels).max(22.0) / unit).ceil().max(1.0) as usize;
    for base in own.bases() {
        let class = own.class(base.name);
        for &variant in class.iter().step_by(every) {
            figure.text([x[variant], plot.y[1] + 16.0], 11.0, Anchor::Middle, INK, &labels[variant]);
        }
        let (first, last) = (x[class[0]], x[class[class.len() - 1]]);
        let middle = [(first + last) / 2.0, plot.y[1] + 36.0];
        figure.named(middle, base.paper, colour(own, &base));
    }
}

/// Figure 6: box plots of the normalised errors.
pub fn boxes(material: &Material) -> String {
    let own = material.own;
    let boxes: Vec<_> = (0..own.variants.len()).map(|v| box_statistics(&own.normalized(v))).collect();
    let diamonds =
        "Open diamonds: the paper's medians over 28 trajectories (Table 4); triangles with a number: beyond the axis. ";
    let lines = [
        "Score over the lowest score of the same trajectory, minus 1 (Eq. 19). Box: quartiles and median; small square: mean; whiskers: 1.5 interquartile ranges; dots: outliers.",
        &format!("{}{}", if material.is_beside_paper() { diamonds } else { "" }, what_labels_are(own)),
    ];
    let mut figure = Figure::new(WIDTH, 480.0, "Figure 6: normalised calibration errors of the variants", &lines);
    let whiskers = boxes.iter().flatten().map(|b| b.whiskers[1]).fold(0.0, f64::max);
    let outliers = || boxes.iter().flatten().flat_map(|b| &b.outliers);
    let highest = outliers().copied().fold(whiskers, f64::max).min(1.6 * whiskers.max(1e-9));
    let plot = Plot::new([LEFT, RIGHT], [104.0, 420.0], highest);
    plot.axis(&mut figure, "normalised error");
    let (x, unit) = positions(own, &plot);
    let half = (0.38 * unit).min(14.0);
    for (v, b) in boxes.iter().enumerate() {
        let Some(b) = b else { continue };
        let (x, fill, y) = (x[v], colour(own, &own.variants[v].base), |value: f64| plot.height(value));
        let paper = material.printed(&own.variants[v]).map_or(String::new(), |p| format!(" (paper {:.3})", p.median));
        let text = format!(
            "{}: median {:.3}{paper}, quartiles {:.3} and {:.3}, mean {:.3}, {}",
            called(&own.variants[v]),
            b.quartiles[1],
            b.quartiles[0],
            b.quartiles[2],
            b.mean,
            counted(b.outliers.len(), "outlier")
        );
        figure.with_tooltip(&text, |figure| {
            figure.line([x, y(b.whiskers[0])], [x, y(b.quartiles[0])], 1.0, INK);
            figure.line([x, y(b.quartiles[2])], [x, y(b.whiskers[1])], 1.0, INK);
            figure.bar([x - half, y(b.quartiles[2])], [x + half, y(b.quartiles[0])], fill, INK);
            figure.line([x - half, y(b.quartiles[1])], [x + half, y(b.quartiles[1])], 2.0, "white");
            figure.bar([x - 1.5, y(b.mean) - 1.5], [x + 1.5, y(b.mean) + 1.5], "white", INK);
            for outlier in b.outliers.iter().filter(|o| **o <= plot.top) {
                figure.dot([x, y(*outlier)], 1.8, INK);
            }
            if let Some(printed) = material.printed(&own.variants[v]) {
                match printed.median > plot.top {
                    true => figure.beyond([x, plot.y[0]], 3.2, &format!("{:.2}", printed.median)),
                    false => figure.diamond([x, y(printed.median)], 3.2),
                }
            }
        });
    }
    ids(&mut figure, own, &plot, &x, unit);
    let beyond = outliers().filter(|o| **o > plot.top).count();
    if beyond > 0 {
        let text = format!("not shown: {} above {:.2}; see figure6.csv", counted(beyond, "outlier"), plot.top);
        figure.text([RIGHT, 472.0], 11.5, Anchor::End, INK, &text);
    }
    figure.finish()
}

/// Figure 7: collisions of the winners on other trajectories.
pub fn collisions(material: &Material) -> String {
    let own = material.own;
    let steps = "Grey steps: the paper, 168 runs per variant, NRMSE(s,v,a) (Table 5). ";
    let lines = [
        "Winners of each calibration, simulated on the other trajectories of the same vehicle: share of runs with a collision.",
        &format!("{}{}", if material.is_beside_paper() { steps } else { "" }, what_labels_are(own)),
    ];
    let mut figure = Figure::new(WIDTH, 480.0, "Figure 7: collisions in validation", &lines);
    let share = |outcomes: &Outcomes, v: usize| {
        let (collisions, _, runs) = outcomes.collisions(v);
        (runs > 0).then(|| 100.0 * collisions as f64 / runs as f64)
    };
    let printed = |v: usize| material.printed(&own.variants[v]).map(|p| 100.0 * p.collisions / VALIDATIONS);
    let ours = material.all.iter().flat_map(|o| (0..o.variants.len()).filter_map(|v| share(o, v)));
    let highest = ours.chain((0..own.variants.len()).filter_map(printed)).fold(1.0, f64::max);
    let plot = Plot::new([LEFT, RIGHT], [112.0, 420.0], highest);
    plot.axis(&mut figure, "collisions [% of runs]");
    let (x, unit) = positions(own, &plot);
    for (v, x) in x.iter().enumerate() {
        if let Some(printed) = printed(v) {
            let y = plot.height(printed);
            figure.bar([x - 0.5 * unit, y], [x + 0.5 * unit, plot.y[1]], "#efefef", "none");
            figure.line([x - 0.5 * unit, y], [x + 0.5 * unit, y], 1.6, PAPER);
        }
    }
    let mut entries = if material.is_beside_paper() { vec![("paper", PAPER)] } else { Vec::new() };
    for (k, outcomes) in material.all.iter().enumerate() {
        let colour = PALETTE[k % PALETTE.len()];
        entries.push((outcomes.gof.as_str(), colour));
        for base in own.bases() {
            let class = outcomes.class(base.name);
            let places = class.iter().filter_map(|&v| {
                let at = own.variants.iter().position(|variant| *variant == outcomes.variants[v])?;
                Some((v, [x[at], plot.height(share(outcomes, v)?)]))
            });
            let (variants, points): (Vec<usize>, Vec<[f64; 2]>) = places.unzip();
            figure.polyline(&points, 1.4, colour);
            for (v, point) in variants.into_iter().zip(points) {
                let ((collisions, _, runs), variant) = (outcomes.collisions(v), &outcomes.variants[v]);
                let text = format!("{}, {}: {collisions} of {runs} runs collide", called(variant), outcomes.gof);
                figure.with_tooltip(&text, |figure| figure.dot(point, 2.6, colour));
            }
        }
    }
    if material.all.iter().all(|o| (0..o.variants.len()).all(|v| share(o, v).is_none())) {
        figure.text([(LEFT + RIGHT) / 2.0, 260.0], 14.0, Anchor::Middle, INK, "this study has no validation runs");
    }
    figure.line([LEFT, plot.y[1]], [RIGHT, plot.y[1]], 1.0, INK);
    figure.legend([LEFT, 92.0], &entries);
    ids(&mut figure, own, &plot, &x, unit);
    figure.finish()
}
