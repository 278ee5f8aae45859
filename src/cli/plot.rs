//! `--plot`: spacing and speed, or the acceleration of a law, as text charts as wide as the terminal.

use super::output;
use crate::report::terminal::{Curve, chart};
use std::io::IsTerminal;

/// Columns without a terminal.
const COLUMNS: usize = 80;
/// Marks and colours of the measured car, of the model, of its extension.
const STYLES: [(char, Option<u8>); 3] = [('.', None), ('x', Some(33)), ('o', Some(36))];

/// A name with spacing and speed.
type Line = (&'static str, [Vec<f64>; 2]);

/// Width of the terminal in columns, and whether it shows colours.
fn terminal() -> (usize, bool) {
    let terminal = std::io::stdout().is_terminal();
    let columns = terminal_size::terminal_size().filter(|_| terminal).map_or(COLUMNS, |(width, _)| width.0.into());
    // https://no-color.org: set and not empty.
    (columns, terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()))
}

/// A label, and named lines.
pub type Chart = (String, Vec<(&'static str, Vec<f64>)>);

/// Prints accelerations over spacings \[m\].
pub fn print_accelerations(title: &str, s: &[f64], charts: &[Chart]) -> anyhow::Result<()> {
    let (columns, colours) = terminal();
    let mut text = format!("\n{title}\n");
    for (label, lines) in charts {
        let curves = lines.iter().zip(STYLES).map(|((name, values), (mark, colour))| {
            let values = values.clone();
            Curve { name, mark, colour, values }
        });
        text += &chart(label, (s, "m"), &curves.collect::<Vec<_>>(), columns, colours);
    }
    output::print_as_is(&text)
}

/// Prints both signals; `lines` are names with spacing and speed, the measured car first.
pub fn print(title: &str, t: &[f64], lines: &[Line]) -> anyhow::Result<()> {
    let (columns, colours) = terminal();
    let mut text = format!("\n{}\n", crate::text::shown::name(title));
    for (k, label) in ["spacing s [m]", "speed v [m/s]"].into_iter().enumerate() {
        let mut curves: Vec<Curve> = Vec::new();
        for ((name, values), (mark, colour)) in lines.iter().zip(STYLES) {
            curves.push(Curve { name, mark, colour, values: values[k].clone() });
        }
        text += &chart(label, (t, "s"), &curves, columns, colours);
    }
    // Its colours are meant.
    output::print_as_is(&text)
}
