//! Additions around the header of a table: comments before it, and a row of units after it.

use super::header::{Field, split};
use super::lines::Lines;
use super::problems::{Problems, Stop};
use crate::trajectory::Note;
use std::io::Read;

/// The first line that is not a comment, and the lines before it. A comment is the header if `named`, the number of
/// columns that a line names, is two or more, or if numbers follow it.
pub(super) fn header<R: Read>(
    lines: &mut Lines<R>,
    problems: &mut Problems,
    notes: &mut Vec<Note>,
    named: impl Fn(&str) -> usize,
) -> Result<Option<String>, Stop> {
    let (first, mut comments) = (lines.number() + 1, 0);
    let mut last: Option<String> = None;
    loop {
        let Some(line) = lines.next(problems)?.map(str::to_owned) else {
            return Ok(None);
        };
        let text = line.trim_start();
        if let Some(comment) = text.strip_prefix(['#', '%']) {
            let bare = comment.trim_start_matches(['#', '%', ' ']);
            // The sign may belong to the first name.
            let header = if named(&line) > named(bare) { line.as_str() } else { bare };
            if named(header) > 1 {
                note_comments(notes, first, comments);
                return Ok(Some(header.to_owned()));
            }
            comments += 1;
            last = Some(bare.to_owned());
        } else if !text.is_empty() || comments == 0 {
            let names = last.take().filter(|names| is_of_numbers(&line) && columns(names) == columns(&line));
            if names.is_some() {
                lines.unread();
                comments -= 1;
            }
            note_comments(notes, first, comments);
            return Ok(Some(names.unwrap_or(line)));
        } else {
            comments += 1;
        }
    }
}

fn note_comments(notes: &mut Vec<Note>, line: u64, lines: u64) {
    if lines > 0 {
        notes.push(Note::LinesSkipped { line, lines, what: "comments".to_owned() });
    }
}

fn columns(line: &str) -> usize {
    let mut fields = Vec::new();
    split(line, &mut fields);
    fields.len()
}

fn is_of_numbers(line: &str) -> bool {
    let mut fields = Vec::new();
    split(line, &mut fields);
    fields.iter().any(|field| !field.text.is_empty())
        && fields.iter().all(|field| field.text.is_empty() || field.text.parse::<f64>().is_ok())
}

/// Units as they are written behind a header, without brackets.
const UNITS: [&str; 52] = [
    "s", "sec", "secs", "second", "seconds", "ms", "us", "ns", "min", "hh:mm:ss", "m", "meter", "meters", "metre",
    "metres", "km", "cm", "mm", "ft", "feet", "yd", "mi", "m/s", "mps", "m s-1", "m/sec", "km/h", "kmh", "kph", "kmph",
    "mph", "ft/s", "fps", "kn", "knots", "m/s2", "m/s^2", "m/s/s", "m/s²", "m s-2", "ft/s2", "ft/s^2", "g", "-", "1",
    "%", "deg", "°", "rad", "degree", "degrees", "hz",
];

/// A unit without the brackets around it, in small letters.
pub(super) fn bare(unit: &str) -> String {
    unit.trim_matches(['[', ']', '(', ')', '"', ' ']).to_lowercase()
}

/// True if a row holds the units of its columns: it has units only, and at least one is not a number.
pub(super) fn is_units(fields: &[Field]) -> bool {
    let given = || fields.iter().map(|field| field.text).filter(|text| !text.is_empty());
    let bracketed = |text: &str| text.starts_with(['[', '(']) && text.ends_with([']', ')']);
    let unit = |text: &str| bracketed(text) || UNITS.contains(&bare(text).as_str());
    given().all(unit) && given().any(|text| text != "-" && text.parse::<f64>().is_err())
}
