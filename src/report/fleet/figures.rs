//! Pictures of many drivers, drawn from counts, so that ten thousand take no more room than ten.

use super::Fit;
use crate::fleet::Spread;
use crate::report::figure::{Anchor, Figure, INK, PALE, PALETTE};
use crate::report::html::{short, within};
use crate::statistics::spearman;

/// Values of one parameter, with its name and unit.
#[derive(Debug, Clone)]
pub struct Distribution<'a> {
    pub name: String,
    pub values: &'a [f64],
    pub spread: Option<Spread>,
}

/// Number of bars of a histogram, and of cells on a side of a picture of two parameters.
const BARS: usize = 40;
const CELLS: usize = 20;
/// Number of histograms in a row, and the size of one \[px\].
const IN_A_ROW: usize = 3;
const SIZE: [f64; 2] = [290.0, 170.0];
const BASE: &str = "#9ec5e6";

impl Distribution<'_> {
    /// From the lowest to the highest value; wider if they are equal.
    pub fn ends(&self) -> [f64; 2] {
        let finite = || self.values.iter().copied().filter(|x| x.is_finite());
        let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        if low < high { [low, high] } else { [low - 0.5, low + 0.5] }
    }

    /// Index of the equal part that contains a value.
    fn part(&self, [low, high]: [f64; 2], x: f64, parts: usize) -> usize {
        (((x - low) / (high - low) * parts as f64) as usize).min(parts - 1)
    }
}

/// One histogram per parameter.
pub fn histograms(all: &[Distribution]) -> String {
    let rows = all.len().div_ceil(IN_A_ROW);
    let mut figure = Figure::new(IN_A_ROW as f64 * SIZE[0], rows as f64 * SIZE[1], "", &[]);
    for (k, one) in all.iter().enumerate() {
        let corner = [(k % IN_A_ROW) as f64 * SIZE[0] + 16.0, (k / IN_A_ROW) as f64 * SIZE[1] + 14.0];
        histogram(&mut figure, corner, one);
    }
    figure.finish()
}

fn histogram(figure: &mut Figure, [left, top]: [f64; 2], one: &Distribution) {
    let (width, height) = (SIZE[0] - 34.0, SIZE[1] - 56.0);
    let [low, high] = one.ends();
    let mut counts = [0_usize; BARS];
    for x in one.values.iter().filter(|x| x.is_finite()) {
        counts[one.part([low, high], *x, BARS)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let bottom = top + 16.0 + height;
    figure.text([left, top + 4.0], 13.0, Anchor::Start, INK, &one.name);
    let at = |x: f64| left + (x - low) / (high - low) * width;
    for (k, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let middle = low + (k as f64 + 0.5) / BARS as f64 * (high - low);
        let inside = one.spread.is_some_and(|s| (s.middle_half[0]..=s.middle_half[1]).contains(&middle));
        let (from, to) = (left + k as f64 / BARS as f64 * width, left + (k + 1) as f64 / BARS as f64 * width);
        let colour = if inside { PALETTE[0] } else { BASE };
        let edges = [k, k + 1].map(|k| short(low + k as f64 / BARS as f64 * (high - low)));
        figure.with_tooltip(&format!("{count} between {} and {}", edges[0], edges[1]), |figure| {
            figure.bar([from, bottom - *count as f64 / most * height], [to, bottom], colour, "none");
        });
    }
    figure.line([left, bottom], [left + width, bottom], 1.0, INK);
    if let Some(spread) = one.spread {
        let x = at(spread.median);
        figure.line([x, top + 14.0], [x, bottom], 1.6, INK);
        // If the middle is close to an end, their numbers would overlap.
        if (0.25..0.75).contains(&((x - left) / width)) {
            figure.text([x, bottom + 15.0], 11.5, Anchor::Middle, INK, &short(spread.median));
        }
    }
    figure.text([left, bottom + 15.0], 11.5, Anchor::Start, INK, &short(low));
    figure.text([left + width, bottom + 15.0], 11.5, Anchor::End, INK, &short(high));
}

/// Every two parameters: numbers of drivers per cell, and their rank correlation.
pub fn together(all: &[Distribution]) -> String {
    const CELL: f64 = 130.0;
    let n = all.len();
    let side = CELL * (n - 1) as f64;
    let mut figure = Figure::new((side + 80.0).max(IN_A_ROW as f64 * SIZE[0]), side + 54.0, "", &[]);
    for (row, down) in all.iter().enumerate().skip(1) {
        let top = 20.0 + CELL * (row - 1) as f64;
        figure.upright([16.0, top + CELL / 2.0 - 10.0], 12.5, &down.name);
        for (column, right) in all.iter().enumerate().take(row) {
            let left = 62.0 + CELL * column as f64;
            let pairs: Vec<(f64, f64)> = right
                .values
                .iter()
                .zip(down.values)
                .filter(|(x, y)| x.is_finite() && y.is_finite())
                .map(|(x, y)| (*x, *y))
                .collect();
            density(&mut figure, [left, top, CELL - 20.0], &pairs, [right, down]);
            if column == 0 {
                for (y, x) in [(top + 9.0, down.ends()[1]), (top + CELL - 22.0, down.ends()[0])] {
                    figure.text([left - 4.0, y], 10.0, Anchor::End, INK, &within(x, down.ends()));
                }
            }
            let rank = spearman(&pairs).map_or("–".to_owned(), |r| format!("{r:+.2}"));
            figure.text([left + CELL - 20.0, top - 4.0], 12.0, Anchor::End, INK, &rank);
            if row == n - 1 {
                figure.text([left + CELL / 2.0 - 10.0, top + CELL + 8.0], 12.5, Anchor::Middle, INK, &right.name);
                let [low, high] = right.ends();
                figure.text([left, top + CELL - 7.0], 10.0, Anchor::Start, INK, &within(low, [low, high]));
                figure.text([left + CELL - 20.0, top + CELL - 7.0], 10.0, Anchor::End, INK, &within(high, [low, high]));
            }
        }
    }
    figure.finish()
}

fn density(figure: &mut Figure, [left, top, side]: [f64; 3], pairs: &[(f64, f64)], [x, y]: [&Distribution; 2]) {
    let (ends_x, ends_y) = (x.ends(), y.ends());
    let mut counts = vec![0_usize; CELLS * CELLS];
    for (a, b) in pairs {
        counts[y.part(ends_y, *b, CELLS) * CELLS + x.part(ends_x, *a, CELLS)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    figure.bar([left, top], [left + side, top + side], "none", PALE);
    let cell = side / CELLS as f64;
    for (k, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (column, row) = ((k % CELLS) as f64, (k / CELLS) as f64);
        let from = [left + column * cell, top + side - (row + 1.0) * cell];
        // A few drivers must be visible beside many.
        let share = (*count as f64 / most).sqrt();
        figure.bar(from, [from[0] + cell, from[1] + cell], &shade(share), "none");
    }
}

/// From pale to full blue.
fn shade(share: f64) -> String {
    let between = |pale: f64, full: f64| (pale + share * (full - pale)).round() as u8;
    format!("#{:02x}{:02x}{:02x}", between(214.0, 0.0), between(230.0, 80.0), between(245.0, 160.0))
}

/// Small pictures of fits: measured and simulated spacing.
pub fn fits(all: &[(String, &Fit)]) -> String {
    let (columns, rows) = (IN_A_ROW, all.len().div_ceil(IN_A_ROW));
    let mut figure = Figure::new(columns as f64 * SIZE[0], rows as f64 * SIZE[1] + 26.0, "", &[]);
    figure.legend([16.0, 18.0], &[("measured spacing", INK), ("simulated", PALETTE[1])]);
    for (k, (name, fit)) in all.iter().enumerate() {
        let (left, top) = ((k % columns) as f64 * SIZE[0] + 16.0, (k / columns) as f64 * SIZE[1] + 40.0);
        let (width, height) = (SIZE[0] - 34.0, SIZE[1] - 56.0);
        let bottom = top + 16.0 + height;
        let [t, measured, simulated, ..] = &fit.signals;
        let most = measured.iter().chain(simulated).copied().filter(|x| x.is_finite()).fold(1.0, f64::max);
        let (first, last) = (t.first().copied().unwrap_or(0.0), t.last().copied().unwrap_or(1.0));
        let place =
            |(t, s): (&f64, &f64)| [left + (t - first) / (last - first).max(1e-9) * width, bottom - s / most * height];
        figure.text([left, top + 4.0], 12.0, Anchor::Start, INK, name);
        figure.line([left, bottom], [left + width, bottom], 1.0, INK);
        for (signal, colour, thick) in [(measured, INK, 1.2), (simulated, PALETTE[1], 1.6)] {
            // No more points than pixels.
            let every = (t.len() / width as usize).max(1);
            let points: Vec<[f64; 2]> =
                t.iter().zip(signal).step_by(every).filter(|(_, s)| s.is_finite()).map(place).collect();
            figure.polyline(&points, thick, colour);
        }
        figure.text([left, bottom + 15.0], 11.5, Anchor::Start, INK, &format!("{first:.0} s"));
        figure.text([left + width, bottom + 15.0], 11.5, Anchor::End, INK, &format!("{last:.0} s, up to {most:.0} m"));
    }
    figure.finish()
}
