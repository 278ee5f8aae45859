//! Tables of a page: sortable, numbers to the right, shares with a bar behind them.

use super::{Page, escape};
use std::borrow::Cow;
use std::fmt::Write;

/// Tables with at least this many rows scroll separately.
const LONG: usize = 14;
/// Number of characters from which a column keeps its width on a narrow screen, because its rows would become as high as
/// the screen.
const SENTENCE: usize = 20;

impl Page {
    /// Adds a table; columns of numbers are right-aligned, a click on a heading sorts. Nothing is added without rows.
    pub fn table(&mut self, caption: &str, head: &[&str], rows: &[Vec<String>]) {
        self.table_with(caption, head, rows, &|_, _| None);
    }

    /// Adds a table whose cells may be shares, from 0 to 1: `share(row, column)`.
    pub fn table_with(
        &mut self,
        caption: &str,
        head: &[&str],
        rows: &[Vec<String>],
        share: &dyn Fn(usize, usize) -> Option<f64>,
    ) {
        if rows.is_empty() {
            return;
        }
        let class = |column: usize| match is_numeric(rows, column) {
            true => " class=\"number\"",
            false if rows.iter().any(|row| row.get(column).is_some_and(|cell| cell.chars().count() > SENTENCE)) => {
                " class=\"words\""
            }
            false => "",
        };
        let classes: Vec<&str> = (0..head.len()).map(class).collect();
        let long = if rows.len() > LONG { " long" } else { "" };
        let mut html = format!(
            "<div class=\"table{long}\" tabindex=\"0\"><table><caption>{}</caption><thead><tr>",
            escape(caption)
        );
        for (column, name) in head.iter().enumerate() {
            let (class, name) = (classes[column], escape(name));
            // Writing to a String cannot fail.
            let _ = write!(html, "<th scope=\"col\"{class}><button type=\"button\">{name}</button></th>");
        }
        html.push_str("</tr></thead><tbody>");
        for (number, row) in rows.iter().enumerate() {
            html.push_str("<tr>");
            for (column, cell) in row.iter().enumerate() {
                // Allows line breaks after each folder of a path, so that no path makes a table wider than a page; units stay
                // together.
                let cell = escape(&inert(cell)).replace('/', "/<wbr>").replace("m/<wbr>s", "m/s");
                let _ = match share(number, column).filter(|share| share.is_finite()) {
                    Some(share) => {
                        let percent = 100.0 * share.clamp(0.0, 1.0);
                        write!(html, "<td class=\"number share\" style=\"--share:{percent:.1}%\">{cell}</td>")
                    }
                    None => write!(html, "<td{}>{cell}</td>", classes[column]),
                };
            }
            html.push_str("</tr>");
        }
        html.push_str("</tbody></table></div>");
        self.raw(&html);
    }
}

/// True for a text that a spreadsheet would take for a formula; not for a number.
pub fn is_formula(cell: &str) -> bool {
    cell.trim_start().starts_with(['=', '+', '-', '@']) && !is_empty(cell) && !is_number(cell)
}

/// A formula made plain text by an apostrophe: tables of a page are copied into spreadsheets.
fn inert(cell: &str) -> Cow<'_, str> {
    if is_formula(cell) { Cow::Owned(format!("'{cell}")) } else { Cow::Borrowed(cell) }
}

/// True if every filled cell of a column is a number or made of numbers; the first column has names.
fn is_numeric(rows: &[Vec<String>], column: usize) -> bool {
    let mut cells = rows.iter().filter_map(|row| row.get(column)).filter(|cell| !is_empty(cell)).peekable();
    column > 0 && cells.peek().is_some() && cells.all(|cell| is_number(cell))
}

/// Mark of an empty cell.
fn is_empty(cell: &str) -> bool {
    matches!(cell, "" | "-" | "–")
}

/// `1.5`, `1 to 2`, `3 of 4`, `12 %`.
fn is_number(cell: &str) -> bool {
    // In parentheses: an end of an interval that is a bound.
    let cell = cell.replace('−', "-").replace(['(', ')'], "");
    let mut words = cell.split_whitespace();
    words.all(|word| word.parse::<f64>().is_ok() || matches!(word, "to" | "of" | "%" | "≥"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(cells: &[&str]) -> bool {
        let rows: Vec<Vec<String>> = cells.iter().map(|cell| vec![String::new(), (*cell).to_owned()]).collect();
        is_numeric(&rows, 1)
    }

    #[test]
    fn columns_of_numbers_are_told_from_others() {
        assert!(column(&["1.5", "-", "+3e-7", "−2"]) && column(&["0 of 2", "12 %", "1.5 to 2", "(30) to (35)"]));
        assert!(!column(&["-", "–", ""]) && !column(&["529f2d02c6324f5f"]) && !column(&["1 Synthetic(B)"]));
        assert!(!column(&["1.5", "m/s"]));
    }

    #[test]
    fn formulas_are_inert() {
        assert_eq!(inert("=1+1"), "'=1+1");
        assert_eq!(inert("@SUM(A1)"), "'@SUM(A1)");
        assert_eq!(inert("\t=1+1"), "'\t=1+1");
        for plain in ["-1.5", "+3e-7", "-", "-1.5 to 2", "car = 2", "", "a-b"] {
            assert_eq!(inert(plain), plain);
        }
    }

    #[test]
    fn shares_have_bars_and_no_rows_no_table() {
        let mut page = Page::default();
        page.table("c", &["a"], &[]);
        assert_eq!(page.body, "");
        page.table_with("c", &["a", "b"], &[vec!["x <".to_owned(), "40 %".to_owned()]], &|_, c| {
            (c == 1).then_some(0.4)
        });
        assert!(page.body.contains("<td class=\"number share\" style=\"--share:40.0%\">40 %</td>"), "{}", page.body);
        assert!(page.body.contains("<td>x &lt;</td>"));
    }
}
