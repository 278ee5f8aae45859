//! Lines over time as text, for a terminal: made of ASCII marks, so that they are distinct without colours and in every font.

use std::fmt::Write;

/// Rows of a chart.
const ROWS: usize = 11;
/// Columns of the numbers on the left.
const NUMBERS: usize = 8;
/// Columns below which a chart shows nothing.
const NARROWEST: usize = 40;
/// Where two lines meet.
const BOTH: char = '#';

/// One line.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve<'a> {
    pub name: &'a str,
    pub mark: char,
    /// Its ANSI colour, such as 33; none for that of the text.
    pub colour: Option<u8>,
    /// Its values; a value that is not finite leaves a gap.
    pub values: Vec<f64>,
}

/// A chart of this many columns over a signal and its unit; every column shows the lowest and the highest of its samples and all between them.
/// Empty without a value.
pub fn chart(label: &str, (t, unit): (&[f64], &str), curves: &[Curve], columns: usize, colours: bool) -> String {
    let finite = || curves.iter().flat_map(|curve| &curve.values).copied().filter(|value| value.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high || t.is_empty() {
        return String::new();
    }
    let high = if high - low > 1e-9 { high } else { low + 1.0 };
    let width = columns.max(NARROWEST) - NUMBERS - 2;
    let cells = cells(t.len(), curves, [low, high], width);
    let mut text = legend(label, curves, colours);
    for (row, line) in cells.iter().enumerate() {
        let value = high - (high - low) * row as f64 / (ROWS - 1) as f64;
        let number = if row % (ROWS / 2) == 0 { format!("{value:.1}") } else { String::new() };
        // Writing to a String cannot fail.
        let _ = write!(text, "{number:>NUMBERS$} |");
        let end = line.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        for cell in &line[..end] {
            match cell {
                None => text.push(' '),
                Some(Cell::Both) => text.push(BOTH),
                Some(Cell::Of(k)) => text.push_str(&painted(&curves[*k], colours)),
            }
        }
        text.push('\n');
    }
    let (from, to) = (format!("{:.0}", t[0]), format!("{:.0} {unit}", t[t.len() - 1]));
    let _ = writeln!(text, "{:>NUMBERS$} +{}", "", "-".repeat(width));
    let _ = writeln!(text, "{:>NUMBERS$}  {from}{to:>room$}", "", room = width.saturating_sub(from.len()));
    text
}

/// Marks in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cell {
    Of(usize),
    Both,
}

fn cells(count: usize, curves: &[Curve], [low, high]: [f64; 2], width: usize) -> Vec<Vec<Option<Cell>>> {
    let row = |value: f64| ((high - value) / (high - low) * (ROWS - 1) as f64).round() as usize;
    let mut cells = vec![vec![None; width]; ROWS];
    for (k, curve) in curves.iter().enumerate() {
        for column in 0..width {
            let (from, to) = (column * count / width, ((column + 1) * count).div_ceil(width).min(count));
            let own = curve.values.iter().take(to).skip(from).filter(|value| value.is_finite());
            let Some((top, bottom)) = own.map(|value| row(*value)).fold(None, |range: Option<(usize, usize)>, row| {
                Some(range.map_or((row, row), |(top, bottom)| (top.min(row), bottom.max(row))))
            }) else {
                continue;
            };
            for line in &mut cells[top..=bottom] {
                line[column] = Some(if line[column].is_some() { Cell::Both } else { Cell::Of(k) });
            }
        }
    }
    cells
}

fn painted(curve: &Curve, colours: bool) -> String {
    match curve.colour.filter(|_| colours) {
        Some(colour) => format!("\x1b[{colour}m{}\x1b[0m", curve.mark),
        None => curve.mark.to_string(),
    }
}

fn legend(label: &str, curves: &[Curve], colours: bool) -> String {
    let names = curves.iter().map(|curve| format!("  {} {}", painted(curve, colours), curve.name));
    format!("{label}{}  {BOTH} several\n", names.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curves() -> Vec<Curve<'static>> {
        let line = |name, mark, colour, slope: f64| Curve {
            name,
            mark,
            colour,
            values: (0..1000).map(|i| slope * f64::from(i)).collect(),
        };
        vec![line("measured", '.', None, 0.01), line("simulated", 'x', Some(33), 0.005)]
    }

    #[test]
    fn a_chart_has_the_width_that_it_is_given_and_shows_both_lines() {
        let t: Vec<f64> = (0..1000).map(|i| f64::from(i) * 0.1).collect();
        for width in [40, 80, 200] {
            let text = chart("spacing s [m]", (&t, "s"), &curves(), width, false);
            assert!(text.lines().all(|line| line.chars().count() <= width.max(60)), "{text}");
            assert!(text.lines().skip(1).all(|line| line.chars().count() <= width), "{text}");
            assert_eq!(text.lines().count(), 1 + ROWS + 2);
        }
        let text = chart("spacing s [m]", (&t, "s"), &curves(), 80, false);
        let rows: Vec<&str> = text.lines().skip(1).take(ROWS).collect();
        // Measured ends at the top, simulated half-way up, both begin at the bottom.
        assert!(rows[0].starts_with("    10.0 |") && rows[0].ends_with('.'), "{text}");
        assert!(rows[ROWS / 2].starts_with("     5.0 |") && rows[ROWS / 2].ends_with('x'), "{text}");
        assert!(rows[ROWS - 1].starts_with("     0.0 |#"), "{text}");
        assert!(text.ends_with("100 s\n") && !text.contains('\x1b'), "{text}");
        assert!(chart("s", (&t, "s"), &curves(), 80, true).contains("\x1b[33mx\x1b[0m"));
    }

    #[test]
    fn gaps_constants_and_nothing_are_drawn_too() {
        let line = |values: Vec<f64>| vec![Curve { name: "s", mark: '.', colour: None, values }];
        assert_eq!(chart("s", (&[0.0, 1.0], "s"), &line(vec![f64::NAN; 2]), 80, false), "");
        assert_eq!(chart("s", (&[], "s"), &line(Vec::new()), 80, false), "");
        let text = chart("s", (&[0.0, 1.0, 2.0], "s"), &line(vec![3.0, f64::NAN, 3.0]), 50, false);
        let bottom = text.lines().nth(ROWS).expect("the lowest row");
        assert!(bottom.starts_with("     3.0 |.") && bottom.contains(". "), "{text}");
    }
}
