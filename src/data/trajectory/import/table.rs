//! The rows below a header: numbers checked by the meaning of their column.

use super::header::{Field, Header, column_of, split};
use super::lines::Lines;
use super::preamble;
use super::problems::{Problems, Stop};
use crate::trajectory::Note;
use crate::trajectory::error::{Faults, Problem, ProblemKind};
use crate::trajectory::prepare::SEGMENT_MIN_S;
use std::collections::{BTreeMap, HashMap};
use std::hash::{DefaultHasher, Hasher};
use std::io::Read;

/// A speed above this is in another unit \[m/s\] (324 km/h).
pub(super) const SPEED_LIMIT: f64 = 90.0;
/// A speed below this is not sensor noise at standstill \[m/s\].
pub(super) const REVERSE_LIMIT: f64 = -0.5;
/// No car follows another one at a larger distance \[m\].
const SPACING_LIMIT: f64 = 1e4;
/// No road is longer \[m\]; beyond it a double no longer resolves fractions of a millimetre anyway.
pub(in crate::trajectory) const POSITION_LIMIT: f64 = 1e9;
/// The sine of no road's grade is beyond this.
pub(in crate::trajectory) const GRADE_LIMIT: f64 = 0.5;

/// Meaning of the numbers of a column, and so their range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Meaning {
    /// Strictly increasing \[s\]; never missing.
    Time,
    /// \[m/s\], within the limits above.
    Speed,
    /// Bumper to bumper \[m\]; values that are not above 0 are missing.
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
    /// Column of the header, and its meaning.
    pub numbers: Vec<(usize, Meaning)>,
    /// Columns of text.
    pub texts: Vec<usize>,
    /// Position in `texts` of the column that starts a new time axis with each value.
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
    /// For each row, the trajectory of its group, from 0: a group whose time restarts has several.
    pub pieces: Vec<u32>,
    /// Repeated rows that were taken once.
    pub repeated: Option<Note>,
    /// Faults of single values, by group, piece and place in `Wanted::numbers`.
    faults: BTreeMap<(String, u32, usize), Faults>,
    /// Numbers of spacings above 0 and of the others, and the first of those, by the same.
    spacings: BTreeMap<(String, u32, usize), Spacings>,
}

/// Group and piece of every row of a table without groups.
pub(super) const WHOLE: (&str, u32) = ("", 0);

#[derive(Default)]
struct Spacings {
    above: usize,
    not: usize,
    first: Option<Problem>,
}

/// The times of a group so far.
#[derive(Default)]
struct Axis {
    times: Vec<f64>,
    rows: Vec<usize>,
    hashes: Vec<u64>,
    piece: u32,
}

/// Key that distinguishes a row from another one with the same time.
pub(super) fn fingerprint(line: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    hasher.write(line.as_bytes());
    hasher.finish()
}

/// Reads all rows; problems are collected, not returned.
pub(super) fn read_rows<R: Read>(
    lines: &mut Lines<R>,
    header: &Header,
    wanted: &Wanted,
    problems: &mut Problems,
    notes: &mut Vec<Note>,
) -> Result<Table, Stop> {
    units_row(lines, header, wanted, problems, notes)?;
    lines.keep(wanted.numbers.len() + wanted.texts.len());
    let mut table = Table {
        lines: Vec::new(),
        numbers: vec![Vec::new(); wanted.numbers.len()],
        texts: vec![Vec::new(); wanted.texts.len()],
        terminated: true,
        pieces: Vec::new(),
        repeated: None,
        faults: BTreeMap::new(),
        spacings: BTreeMap::new(),
    };
    let mut axes: HashMap<String, Axis> = HashMap::new();
    while let Some(line) = lines.next(problems)?.map(str::to_owned) {
        let mut fields: Vec<Field> = Vec::with_capacity(header.names.len());
        split(&line, &mut fields);
        let number = lines.number();
        if fields.iter().all(|field| field.text.is_empty()) {
            continue;
        }
        table.terminated = lines.terminated;
        let expected = header.names.len();
        header.check_row(&fields, number, problems)?;
        let surplus = fields.iter().skip(expected).any(|f| !f.text.is_empty());
        if fields.len() < expected || surplus {
            let kind = ProblemKind::FieldCount { expected, found: fields.len(), last: !lines.terminated };
            problems.add(number, Some(1), kind);
            continue;
        }
        let row = Row { line: &line, number, fields: &fields, header };
        table.push(&row, wanted, &mut axes, problems)?;
    }
    table.judge_spacings();
    if problems.check().is_err() {
        table.refuse(problems)?;
    }
    match table.lines.len() {
        0 => Err(problems.stop(header.line, None, ProblemKind::NoRows)),
        1 => Err(problems.stop(table.lines[0], None, ProblemKind::OneRow)),
        _ => Ok(table),
    }
}

/// Skips a row of units behind the header, which must be the units of the columns.
fn units_row<R: Read>(
    lines: &mut Lines<R>,
    header: &Header,
    wanted: &Wanted,
    problems: &mut Problems,
    notes: &mut Vec<Note>,
) -> Result<(), Stop> {
    let Some(line) = lines.next(problems)?.map(str::to_owned) else {
        return Ok(());
    };
    let mut fields: Vec<Field> = Vec::new();
    split(&line, &mut fields);
    if !preamble::is_units(&fields) {
        lines.unread();
        return Ok(());
    }
    for &(column, meaning) in &wanted.numbers {
        let Some(field) = fields.get(column).filter(|field| !field.text.is_empty()) else { continue };
        let expected: &[&str] = match meaning {
            Meaning::Time => &["s", "sec", "secs", "second", "seconds"],
            Meaning::Speed => &["m/s", "mps", "m/sec", "m s-1", "ms-1"],
            Meaning::Spacing | Meaning::Position => &["m", "meter", "meters", "metre", "metres"],
            Meaning::SinGrade | Meaning::Number => continue,
        };
        if !expected.contains(&preamble::bare(field.text).as_str()) {
            let (column, found) = (header.names[column].clone(), field.text.to_owned());
            let kind = ProblemKind::OtherUnit { column, expected: expected[0], found };
            problems.add(lines.number(), Some(column_of(&line, field.start)), kind);
        }
    }
    notes.push(Note::LinesSkipped { line: lines.number(), lines: 1, what: format!("units, {}", line.trim()) });
    problems.check()
}

struct Row<'a> {
    line: &'a str,
    number: u64,
    fields: &'a [Field<'a>],
    header: &'a Header,
}

impl Table {
    fn push(
        &mut self,
        row: &Row,
        wanted: &Wanted,
        axes: &mut HashMap<String, Axis>,
        problems: &mut Problems,
    ) -> Result<(), Stop> {
        let position = self.lines.len();
        let group = wanted.group.map_or("", |g| row.fields[wanted.texts[g]].text);
        if !axes.contains_key(group) {
            axes.insert(group.to_owned(), Axis::default());
        }
        let axis = axes.get_mut(group).expect("it was just put there");
        let hash = fingerprint(row.line);
        let place = wanted.numbers.iter().position(|(_, meaning)| *meaning == Meaning::Time);
        let time = place.and_then(|place| row.fields[wanted.numbers[place].0].text.parse::<f64>().ok());
        let twice = time.and_then(|time| axis.times.binary_search_by(|other| other.total_cmp(&time)).ok());
        if twice.is_some_and(|twice| axis.hashes[twice] == hash) {
            self.repeat(row.number);
            return Ok(());
        }
        if let (Some(&first), Some(&last), Some(time)) = (axis.times.first(), axis.times.last(), time)
            && time <= first
            && last - first >= SEGMENT_MIN_S
        {
            if wanted.group.is_none() {
                let column = place.map_or(0, |place| wanted.numbers[place].0);
                let kind = ProblemKind::TimeAnew { column: row.header.names[column].clone(), found: time };
                return Err(problems.stop(row.number, None, kind));
            }
            *axis = Axis { piece: axis.piece + 1, ..Axis::default() };
        }
        self.lines.push(row.number);
        self.pieces.push(axis.piece);
        for (changes, &column) in self.texts.iter_mut().zip(&wanted.texts) {
            let text = row.fields[column].text;
            if changes.last().is_none_or(|(_, previous)| previous != text) {
                changes.push((position, text.to_owned()));
            }
        }
        for (place, &(column, meaning)) in wanted.numbers.iter().enumerate() {
            let field = row.fields[column];
            let before = axis.times.last().map(|&time| (time, twice.map(|twice| self.lines[axis.rows[twice]])));
            let mut value = number(field.text, &row.header.names[column], meaning, before);
            if meaning == Meaning::Spacing {
                value = self.positive(value, (group, axis.piece, place), row, column);
            }
            let value = value.unwrap_or_else(|kind| {
                let at = Some(column_of(row.line, field.start));
                if meaning == Meaning::Time {
                    problems.add(row.number, at, kind);
                } else {
                    let faults = self.faults.entry((group.to_owned(), axis.piece, place)).or_default();
                    faults.add(Problem { line: row.number, column: at, kind });
                }
                f64::NAN
            });
            if meaning == Meaning::Time && value.is_finite() {
                axis.times.push(value);
                axis.rows.push(position);
                axis.hashes.push(hash);
            }
            self.numbers[place].push(value);
        }
        Ok(())
    }

    fn repeat(&mut self, line: u64) {
        let before = match self.repeated {
            Some(Note::RowsRepeated { rows, line, .. }) => Some((rows, line)),
            _ => None,
        };
        let (rows, line) = before.unwrap_or((0, line));
        self.repeated = Some(Note::RowsRepeated { rows: rows + 1, line });
    }

    /// A spacing that is not above 0 is missing, and counted.
    fn positive(
        &mut self,
        value: Result<f64, ProblemKind>,
        (group, piece, place): (&str, u32, usize),
        row: &Row,
        column: usize,
    ) -> Result<f64, ProblemKind> {
        let Ok(found) = value else { return value };
        if found.is_nan() {
            return value;
        }
        let spacings = self.spacings.entry((group.to_owned(), piece, place)).or_default();
        if found > 0.0 {
            spacings.above += 1;
            return value;
        }
        spacings.not += 1;
        spacings.first.get_or_insert_with(|| Problem {
            line: row.number,
            column: Some(column_of(row.line, row.fields[column].start)),
            kind: ProblemKind::Spacing { column: row.header.names[column].clone(), found },
        });
        Ok(f64::NAN)
    }

    /// A column of spacings none of which is above 0 has another sign, or another meaning.
    fn judge_spacings(&mut self) {
        for (key, spacings) in &mut self.spacings {
            if let (0, Some(first)) = (spacings.above, spacings.first.take()) {
                self.faults.entry(key.clone()).or_default().add(first);
            }
        }
    }

    /// Faults of a column of numbers, by its place among those wanted, in a piece of a group.
    pub fn faults(&self, (group, piece): (&str, u32), place: usize) -> Faults {
        self.faults.get(&(group.to_owned(), piece, place)).cloned().unwrap_or_default()
    }

    /// Note that spacings of a column are not above 0, if some are not.
    pub fn no_gap(&self, (group, piece): (&str, u32), place: usize, car: usize, signal: &str) -> Option<Note> {
        let samples = self.spacings.get(&(group.to_owned(), piece, place)).map_or(0, |spacings| spacings.not);
        (samples > 0).then(|| Note::NoGap { car, signal: signal.to_owned(), samples })
    }

    /// All faults of single values become faults of the file, because it has no other data.
    pub fn refuse(&self, problems: &mut Problems) -> Result<(), Stop> {
        problems.adopt(self.faults.values().cloned());
        problems.check()
    }
}

/// Marks of missing values in the output of common programs.
const MISSING: [&str; 8] = ["", "nan", "na", "n/a", "#n/a", "null", "none", "-"];

/// True for an empty field, and for a word that means the same.
pub(in crate::trajectory) fn is_missing(text: &str) -> bool {
    MISSING.iter().any(|word| text.eq_ignore_ascii_case(word))
}

/// A number, NaN if it is missing, or its fault.
pub(in crate::trajectory) fn finite(text: &str, column: &str) -> Result<f64, ProblemKind> {
    if is_missing(text) {
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

fn number(text: &str, name: &str, meaning: Meaning, before: Option<(f64, Option<u64>)>) -> Result<f64, ProblemKind> {
    let found = if meaning == Meaning::Time { present(text, name)? } else { finite(text, name)? };
    let column = || name.to_owned();
    let wrong = match meaning {
        Meaning::Time => before.and_then(|(previous, same)| match same {
            Some(first) => Some(ProblemKind::TimeTwice { column: column(), found, first }),
            None => (found < previous).then(|| ProblemKind::TimeBack { column: column(), previous, found }),
        }),
        Meaning::Speed if found > SPEED_LIMIT => {
            Some(ProblemKind::SpeedTooHigh { column: column(), limit: SPEED_LIMIT, found })
        }
        Meaning::Speed if found < REVERSE_LIMIT => {
            Some(ProblemKind::SpeedNegative { column: column(), limit: REVERSE_LIMIT, found })
        }
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
