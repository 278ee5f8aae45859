//! `--plot`: spacing and speed, or the acceleration of a law, as text charts as wide as the terminal.

use super::output;
use crate::report::terminal::{Curve, chart};
use std::io::IsTerminal;

/// Columns without a terminal.
const COLUMNS: usize = 80;
/// Marks and colours of the measured car, of the model, of its extension.
const STYLES: [(char, Option<u8>); 3] = [('.', None), ('x', Some(33)), ('o', Some(36))];

/// Width of the terminal in columns, and whether it shows colours.
fn terminal() -> (usize, bool) {
    let terminal = std::io::stdout().is_terminal();
    let columns = terminal_size::terminal_size().filter(|_| terminal).map_or(COLUMNS, |(width, _)| width.0.into());
    // https://no-color.org: set and not empty.
    (columns, terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()))
}

/// A label, and named lines, the measured car or the law itself first.
pub type Chart = (String, Vec<(&'static str, Vec<f64>)>);

/// Prints charts below a title, over the same values, which have a unit.
pub fn draw(title: &str, over: (&[f64], &str), charts: Vec<Chart>) -> anyhow::Result<()> {
    let (columns, colours) = terminal();
    let mut text = format!("\n{title}\n");
    for (label, lines) in charts {
        let curve = |((name, values), (mark, colour))| Curve { name, mark, colour, values };
        let curves: Vec<Curve> = lines.into_iter().zip(STYLES).map(curve).collect();
        text += &chart(&label, over, &curves, columns, colours);
    }
    // Its colours are meant.
    output::print_as_is(&text)
}

/// Prints both signals over the time \[s\]; `lines` are names with spacing and speed, the measured car first.
pub fn print(title: &str, t: &[f64], lines: &[(&'static str, [Vec<f64>; 2])]) -> anyhow::Result<()> {
    let lines_of = |k: usize| lines.iter().map(|(name, values)| (*name, values[k].clone())).collect();
    let charts = [("spacing s [m]", 0), ("speed v [m/s]", 1)].map(|(label, k)| (label.to_owned(), lines_of(k)));
    draw(&crate::text::shown::name(title), (t, "s"), charts.into())
}
