//! A row per driver and a column per parameter: the estimate with its interval.

use super::figures::Distribution;
use crate::report::figure::{Anchor, Figure, INK, PALE, PALETTE, PAPER};
use crate::report::html::short;

/// Largest number of columns side by side; further parameters go below.
const IN_A_ROW: usize = 4;
/// Width of the names and of a column, height of a row \[px\].
const NAMES: f64 = 130.0;
const COLUMN: f64 = 185.0;
const ROW: f64 = 18.0;
/// The name of the parameter is above the first row, the axis below the last one \[px\].
const AROUND: [f64; 2] = [26.0, 30.0];
/// Characters of a name that fit.
const NAME: usize = 17;

/// Estimates of one parameter, in the order of the drivers; an interval is `None` if the drive does not determine the value.
pub struct Estimates<'a> {
    pub of: Distribution<'a>,
    pub ends: Vec<Option<[f64; 2]>>,
}

/// The drivers by name.
pub fn forest(names: &[&str], all: &[Estimates]) -> String {
    let block = AROUND[0] + ROW * names.len() as f64 + AROUND[1];
    let width = NAMES + COLUMN * all.len().min(IN_A_ROW) as f64;
    let mut figure = Figure::new(width, block * all.len().div_ceil(IN_A_ROW) as f64, "", &[]);
    for (k, own) in all.chunks(IN_A_ROW).enumerate() {
        let top = block * k as f64 + AROUND[0];
        for (row, name) in names.iter().enumerate() {
            let y = top + ROW * (row as f64 + 0.5);
            let shown: String = if name.chars().count() > NAME {
                name.chars().take(NAME - 1).chain(['…']).collect()
            } else {
                (*name).to_owned()
            };
            figure.text([NAMES - 10.0, y + 4.0], 12.0, Anchor::End, INK, &shown);
        }
        for (column, one) in own.iter().enumerate() {
            let left = NAMES + COLUMN * column as f64;
            draw(&mut figure, [left, left + COLUMN - 22.0], top, names, one);
        }
    }
    figure.finish()
}

fn draw(figure: &mut Figure, [left, right]: [f64; 2], top: f64, names: &[&str], one: &Estimates) {
    let bottom = top + ROW * names.len() as f64;
    let [mut low, mut high] = one.of.ends();
    for [from, to] in one.ends.iter().flatten() {
        (low, high) = (low.min(*from), high.max(*to));
    }
    let at = |x: f64| left + (x - low) / (high - low) * (right - left);
    figure.text([left, top - 10.0], 12.5, Anchor::Start, INK, &one.of.name);
    if let Some(spread) = one.of.spread {
        figure.line([at(spread.median), top], [at(spread.median), bottom], 1.0, PALE);
    }
    for (row, (name, value)) in names.iter().zip(one.of.values).enumerate().filter(|(_, (_, x))| x.is_finite()) {
        let y = top + ROW * (row as f64 + 0.5);
        let ends = one.ends.get(row).copied().flatten();
        let told = ends.map_or("not determined".to_owned(), |[low, high]| format!("{} to {}", short(low), short(high)));
        figure.with_tooltip(&format!("{name}: {} {}, {told}", one.of.name, short(*value)), |figure| {
            if let Some([from, to]) = ends {
                figure.line([at(from), y], [at(to), y], 2.0, PALETTE[0]);
            }
            figure.dot([at(*value), y], 3.5, if ends.is_some() { PALETTE[0] } else { PAPER });
        });
    }
    figure.line([left, bottom], [right, bottom], 1.0, INK);
    figure.text([left, bottom + 15.0], 11.5, Anchor::Start, INK, &short(low));
    figure.text([right, bottom + 15.0], 11.5, Anchor::End, INK, &short(high));
}
