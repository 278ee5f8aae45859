//! The rows below a header: numbers checked by what their column means.

use super::header::{Field, Header, column_of, split};
use super::lines::Lines;
use super::problems::{Problems, Stop};
use crate::trajectory::error::ProblemKind;
use std::collections::HashMap;
use std::io::Read;

/// A speed above this is taken for km/h \[m/s\] (324 km/h).
const SPEED_LIMIT: f64 = 90.0;
/// A speed below this is no sensor noise at standstill \[m/s\].
const REVERSE_LIMIT: f64 = -0.5;
/// No car follows another from further away \[m\].
const SPACING_LIMIT: f64 = 1e4;
/// No road is longer \[m\]; beyond it a double no longer resolves fractions of a millimetre anyway.
const POSITION_LIMIT: f64 = 1e9;
/// The sine of no road's grade is beyond this.
pub(in crate::trajectory) const GRADE_LIMIT: f64 = 0.5;

/// What the numbers of a column mean, so what they may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Meaning {
    /// Strictly increasing \[s\]; never missing.
    Time,
    /// \[m/s\], within the limits above.
    Speed,
    /// Bumper to bumper \[m\], above 0.
    Spacing,
    /// Along the road \[m\].
    Position,
    /// Sine of a road grade.
    SinGrade,
    /// Any finite number.
    Number,
}

/// Which columns to read.
pub(super) struct Wanted {
    /// Column of the header, and what it means.
    pub numbers: Vec<(usize, Meaning)>,
    /// Columns of text.
    pub texts: Vec<usize>,
    /// Position in `texts` of the column whose value starts a time axis of its own.
    pub group: Option<usize>,
}

/// The columns of a file.
pub(super) struct Table {
    /// Line of each row in the file.
    pub lines: Vec<u64>,
    /// Values of each wanted column of numbers; missing ones are NaN.
    pub numbers: Vec<Vec<f64>>,
    /// For each wanted column of text: the rows at which it changes, the first row included.
    pub texts: Vec<Vec<(usize, String)>>,
    /// False if the last row has no line end.
    pub terminated: bool,
}

/// Reads all rows; problems are collected, not returned.
pub(super) fn read_rows<R: Read>(
    lines: &mut Lines<R>,
    header: &Header,
    wanted: &Wanted,
    problems: &mut Problems,
) -> Result<Table, Stop> {
    let mut table = Table {
        lines: Vec::new(),
        numbers: vec![Vec::new(); wanted.numbers.len()],
        texts: vec![Vec::new(); wanted.texts.len()],
        terminated: true,
    };
    let mut last_time: HashMap<String, f64> = HashMap::new();
    while let Some(line) = lines.next(problems)?.map(str::to_owned) {
        let mut fields: Vec<Field> = Vec::with_capacity(header.names.len());
        split(&line, &mut fields);
        let number = lines.number();
        if fields.iter().all(|field| field.text.is_empty()) {
            continue;
        }
        table.terminated = lines.terminated;
        let expected = header.names.len();
        let surplus = fields.iter().skip(expected).any(|f| !f.text.is_empty());
        if fields.len() < expected || surplus {
            let kind = ProblemKind::FieldCount { expected, found: fields.len(), last: !lines.terminated };
            problems.add(number, Some(1), kind);
            continue;
        }
        let row = Row { line: &line, number, fields: &fields, header };
        table.push(&row, wanted, &mut last_time, problems);
    }
    problems.check()?;
    match table.lines.len() {
        0 => Err(problems.stop(header.line, None, ProblemKind::NoRows)),
        1 => Err(problems.stop(table.lines[0], None, ProblemKind::OneRow)),
        _ => Ok(table),
    }
}

struct Row<'a> {
    line: &'a str,
    number: u64,
    fields: &'a [Field<'a>],
    header: &'a Header,
}

impl Table {
    fn push(&mut self, row: &Row, wanted: &Wanted, last_time: &mut HashMap<String, f64>, problems: &mut Problems) {
        let position = self.lines.len();
        self.lines.push(row.number);
        for (changes, &column) in self.texts.iter_mut().zip(&wanted.texts) {
            let text = row.fields[column].text;
            if changes.last().is_none_or(|(_, previous)| previous != text) {
                changes.push((position, text.to_owned()));
            }
        }
        let group = wanted.group.map_or("", |g| row.fields[wanted.texts[g]].text);
        for (values, &(column, meaning)) in self.numbers.iter_mut().zip(&wanted.numbers) {
            let value =
                number(row.fields[column].text, &row.header.names[column], meaning, last_time.get(group).copied());
            match value {
                Ok(value) => {
                    if meaning == Meaning::Time {
                        match last_time.get_mut(group) {
                            Some(time) => *time = value,
                            None => drop(last_time.insert(group.to_owned(), value)),
                        }
                    }
                    values.push(value);
                }
                Err(kind) => {
                    let start = row.fields[column].start;
                    problems.add(row.number, Some(column_of(row.line, start)), kind);
                    values.push(f64::NAN);
                }
            }
        }
    }
}

/// A number, NaN if it is missing, or what is wrong with it.
pub(in crate::trajectory) fn finite(text: &str, column: &str) -> Result<f64, ProblemKind> {
    if matches!(text, "" | "NaN" | "nan") {
        return Ok(f64::NAN);
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ if decimal_comma(text) => {
            Err(ProblemKind::DecimalComma { column: column.to_owned(), found: text.to_owned(), mapped: false })
        }
        _ => Err(ProblemKind::NotANumber { column: column.to_owned(), found: text.to_owned(), optional: true }),
    }
}

/// A number that must be there.
pub(in crate::trajectory) fn present(text: &str, column: &str) -> Result<f64, ProblemKind> {
    match finite(text, column) {
        Ok(value) if value.is_nan() => Err(ProblemKind::Missing { column: column.to_owned() }),
        Err(ProblemKind::NotANumber { column, found, .. }) => {
            Err(ProblemKind::NotANumber { column, found, optional: false })
        }
        result => result,
    }
}

fn decimal_comma(text: &str) -> bool {
    text.matches(',').count() == 1 && text.replace(',', ".").parse::<f64>().is_ok()
}

fn number(text: &str, name: &str, meaning: Meaning, previous: Option<f64>) -> Result<f64, ProblemKind> {
    let found = if meaning == Meaning::Time { present(text, name)? } else { finite(text, name)? };
    let column = || name.to_owned();
    let wrong = match meaning {
        Meaning::Time => previous.and_then(|previous| {
            if found == previous {
                let column = column();
                Some(ProblemKind::TimeTwice { column, found })
            } else {
                (found < previous).then(|| ProblemKind::TimeBack { column: column(), previous, found })
            }
        }),
        Meaning::Speed if found > SPEED_LIMIT => {
            Some(ProblemKind::SpeedTooHigh { column: column(), limit: SPEED_LIMIT, found })
        }
        Meaning::Speed if found < REVERSE_LIMIT => {
            Some(ProblemKind::SpeedNegative { column: column(), limit: REVERSE_LIMIT, found })
        }
        Meaning::Spacing if found <= 0.0 => Some(ProblemKind::Spacing { column: column(), found }),
        Meaning::Spacing if found > SPACING_LIMIT => {
            Some(ProblemKind::TooLong { column: column(), limit: SPACING_LIMIT, found })
        }
        Meaning::Position if found.abs() > POSITION_LIMIT => {
            Some(ProblemKind::TooLong { column: column(), limit: POSITION_LIMIT, found })
        }
        Meaning::SinGrade if found.abs() > GRADE_LIMIT => {
            Some(ProblemKind::Grade { column: column(), limit: GRADE_LIMIT, found })
        }
        _ => None,
    };
    wrong.map_or(Ok(found), Err)
}
