//! The rows of a mapped table: numbers in SI, names unchanged.

use super::clock;
use super::guess::Guess;
use super::map::{ColumnMap, Decimal, Separator, whole};
use super::role::Role;
use super::unit::{Form, Quantity};
use super::wanted::{Wanted, wanted};
use crate::trajectory::Note;
use crate::trajectory::error::{Faults, Problem, ProblemKind};
use crate::trajectory::import::driver_modes;
use crate::trajectory::import::header::{Field, Header, check_names, check_separator, column_of, split_at};
use crate::trajectory::import::lines::Lines;
use crate::trajectory::import::preamble;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::import::table::{SPEED_LIMIT, fingerprint, finite, is_missing, present};
use crate::trajectory::steps::PAUSE_S;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io::Read;

/// Consequence of a broken value.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Signal {
    /// Of a platoon; 0 if the column does not belong to one car.
    car: usize,
    is_gap: bool,
}

/// All rows, by role.
pub(super) struct Table {
    /// Line of the header, for messages about the whole table.
    pub header_line: u64,
    /// Line of each row.
    pub lines: Vec<u64>,
    /// By role and, in a table of platoons, number of the car; 0 elsewhere.
    numbers: Vec<((Role, usize), Vec<f64>)>,
    names: Vec<(Role, Vec<u32>)>,
    /// Names by number.
    pub dictionary: Vec<String>,
    /// Key that distinguishes rows of equal times.
    hashes: Vec<u64>,
    /// Number of the piece that each row belongs to: rows of one group and id whose time continues without a pause. One trajectory
    /// or vehicle consists of whole pieces.
    pieces: Vec<u32>,
    /// Faults of single values, by piece and signal.
    faults: BTreeMap<(u32, Signal), Faults>,
    /// Changes while reading: columns and lines that were not read.
    pub notes: Vec<Note>,
    /// False if the last row has no line end.
    pub terminated: bool,
    /// Unread columns that may distinguish drives, in a table without groups.
    pub guess: Vec<String>,
    /// Names of each role in this file, in the order of the cars.
    called: Vec<((Role, usize), String)>,
}

impl Table {
    pub fn numbers(&self, role: Role) -> Option<&[f64]> {
        self.numbers_of(role, 0)
    }

    /// Of one car of a platoon, by its number.
    pub fn numbers_of(&self, role: Role, car: usize) -> Option<&[f64]> {
        self.numbers.iter().find(|(key, _)| *key == (role, car)).map(|(_, values)| values.as_slice())
    }

    /// The numbers of the cars of a platoon, front to back.
    pub fn cars(&self) -> Vec<usize> {
        let mut cars: Vec<usize> =
            self.numbers.iter().filter(|((role, _), _)| *role == Role::Speed).map(|((_, car), _)| *car).collect();
        cars.sort_unstable();
        cars
    }

    pub fn names(&self, role: Role) -> Option<&[u32]> {
        self.names.iter().find(|(r, _)| *r == role).map(|(_, values)| values.as_slice())
    }

    /// Who drives car `car` in these rows, and who takes over.
    pub fn drivers(&self, rows: &[usize], car: usize) -> Vec<Note> {
        let (Some(names), Some(time)) = (self.names(Role::Driver), self.numbers(Role::Time)) else { return Vec::new() };
        driver_modes(car, rows.iter().map(|&row| (time[row], self.dictionary[names[row] as usize].as_str())))
    }

    /// Group and id of a row, 0 without such a column.
    pub fn key(&self, row: usize) -> (u32, u32) {
        let of = |role| self.names(role).map_or(0, |names| names[row]);
        (of(Role::Group), of(Role::Id))
    }

    /// Faults in the values of a trajectory or a vehicle.
    pub fn faults(&self, rows: &[usize]) -> Faults {
        self.faults_where(rows, |_| true)
    }

    /// Faults in the signals of one car of a platoon, and in its gap.
    pub fn faults_of(&self, rows: &[usize], car: usize) -> [Faults; 2] {
        let is_its = |signal: Signal| [0, car].contains(&signal.car);
        [false, true].map(|is_gap| self.faults_where(rows, |signal| is_its(signal) && signal.is_gap == is_gap))
    }

    fn faults_where(&self, rows: &[usize], is_meant: impl Fn(Signal) -> bool) -> Faults {
        let pieces: BTreeSet<u32> = rows.iter().map(|&row| self.pieces[row]).collect();
        let [first, last] = [Signal { car: 0, is_gap: false }, Signal { car: usize::MAX, is_gap: true }];
        let found = pieces.into_iter().flat_map(|piece| self.faults.range((piece, first)..=(piece, last)));
        let mut all = Faults::default();
        found.filter(|((_, signal), _)| is_meant(*signal)).for_each(|(_, faults)| all.merge(faults.clone()));
        all
    }

    /// Faults of single values become faults of the file if no other data of the file remain.
    pub fn refuse(&self, problems: &mut Problems) -> Result<(), Stop> {
        problems.adopt(self.faults.values().cloned());
        problems.check()
    }

    /// True if one row repeats another one exactly.
    pub fn is_repeated(&self, row: usize, other: usize) -> bool {
        self.hashes[row] == self.hashes[other]
    }

    /// Removes and counts rows that repeat another one exactly. For others with the same time `differ` receives the line of the first and
    /// of the second, and the time.
    pub fn take_once(&self, rows: &mut Vec<usize>, repeated: &mut Repeated, mut differ: impl FnMut(u64, u64, f64)) {
        let time = self.numbers(Role::Time).unwrap_or_default();
        let mut seen: HashMap<u64, usize> = HashMap::with_capacity(rows.len());
        rows.retain(|&row| {
            let first = *seen.entry(time[row].to_bits()).or_insert(row);
            if first == row {
                return true;
            }
            if self.hashes[first] == self.hashes[row] {
                repeated.add(self.lines[row]);
            } else {
                differ(self.lines[first], self.lines[row], time[row]);
            }
            false
        });
    }

    /// `NAME (UNIT)` of a role, for messages.
    pub fn called(&self, role: Role) -> String {
        self.called_of(role, 0)
    }

    /// The same of one car of a platoon, by its number.
    pub fn called_of(&self, role: Role, car: usize) -> String {
        self.called.iter().find(|(key, _)| *key == (role, car)).map_or_else(String::new, |(_, name)| name.clone())
    }
}

/// Rows that occur more than once in a table.
#[derive(Default)]
pub(super) struct Repeated {
    rows: usize,
    first: u64,
}

impl Repeated {
    fn add(&mut self, line: u64) {
        self.first = if self.rows == 0 { line } else { self.first.min(line) };
        self.rows += 1;
    }

    pub fn note(&self) -> Option<Note> {
        (self.rows > 0).then_some(Note::RowsRepeated { rows: self.rows, line: self.first })
    }
}

/// The header, and the separator of the fields below it.
fn header<R: Read>(
    lines: &mut Lines<R>,
    map: &ColumnMap,
    problems: &mut Problems,
    notes: &mut Vec<Note>,
) -> Result<(Header, Separator), Stop> {
    for _ in 0..map.skip_lines {
        if lines.next(problems)?.is_none() {
            return Err(problems.stop(lines.number().max(1), None, ProblemKind::AllSkipped { lines: map.skip_lines }));
        }
    }
    if map.skip_lines > 0 {
        notes.push(Note::LinesSkipped {
            line: 1,
            lines: map.skip_lines,
            what: "skip_lines of the column map".to_owned(),
        });
    }
    if let Some(names) = &map.header {
        return Ok((Header::named(names), map.separator));
    }
    let named = |line: &str| {
        let mut fields = Vec::new();
        split_by(line, map.separator, &mut fields);
        let is_named = |field: &Field| {
            map.columns.iter().flat_map(|column| &column.names).any(|name| name.eq_ignore_ascii_case(field.text))
        };
        fields.iter().filter(|field| is_named(field)).count()
    };
    let Some(first) = preamble::header(lines, problems, notes, named)? else {
        return Err(problems.stop(1, None, ProblemKind::Empty));
    };
    let line = lines.number();
    let mut fields = Vec::new();
    if let Some(bare) = &map.headerless {
        split_by(&first, bare.separator, &mut fields);
        let is_number = |field: &Field| field.text.parse::<f64>().is_ok();
        if fields.len() == bare.header.len() && fields.iter().all(is_number) {
            lines.unread();
            return Ok((Header::named(&bare.header), bare.separator));
        }
    }
    if map.separator == Separator::Comma {
        check_separator(&first, line, Some(lines), problems)?;
    }
    split_by(&first, map.separator, &mut fields);
    check_names(&fields, problems)?;
    Ok((Header::of(&first, line, &fields, problems)?, map.separator))
}

/// Skips the row of units behind a header, if there is one, or the map announces one.
fn units_row<R: Read>(
    lines: &mut Lines<R>,
    map: &ColumnMap,
    separator: Separator,
    problems: &mut Problems,
    notes: &mut Vec<Note>,
) -> Result<(), Stop> {
    let Some(line) = lines.next(problems)?.map(str::to_owned) else {
        return Ok(());
    };
    let mut fields = Vec::new();
    split_by(&line, separator, &mut fields);
    if map.units_row || preamble::is_units(&fields) {
        let what = format!("units, {}", line.trim());
        notes.push(Note::LinesSkipped { line: lines.number(), lines: 1, what });
    } else {
        lines.unread();
    }
    Ok(())
}

/// Reads all rows; problems are collected.
pub(super) fn read<R: Read>(lines: &mut Lines<R>, map: &ColumnMap, problems: &mut Problems) -> Result<Table, Stop> {
    let mut notes = Vec::new();
    let (header, separator) = header(lines, map, problems, &mut notes)?;
    let wanted = wanted(&header, map, problems);
    problems.check()?;
    if header.line > 0 {
        units_row(lines, map, separator, problems, &mut notes)?;
    }
    let mut table = Table {
        header_line: header.line,
        lines: Vec::new(),
        numbers: Vec::new(),
        names: Vec::new(),
        dictionary: Vec::new(),
        hashes: Vec::new(),
        pieces: Vec::new(),
        faults: BTreeMap::new(),
        notes,
        terminated: true,
        guess: Vec::new(),
        called: Vec::new(),
    };
    lines.keep(wanted.len());
    for column in &wanted {
        match column.role.quantity() {
            Some(_) => table.numbers.push(((column.role, column.car), Vec::new())),
            None => table.names.push((column.role, Vec::new())),
        }
        let name = &header.names[column.place];
        let unit = if column.unit.is_empty() { String::new() } else { format!(" ({})", column.unit) };
        table.called.push(((column.role, column.car), format!("{name}{unit}")));
    }
    let is_read = |place: usize| wanted.iter().any(|column| column.place == place);
    let unread = header.names.iter().enumerate().filter(|(place, name)| !is_read(*place) && !name.is_empty());
    let unread: Vec<(usize, String)> = unread.map(|(place, name)| (place, name.clone())).collect();
    let columns: Vec<String> = unread.iter().map(|(_, name)| name.clone()).collect();
    let has_group = wanted.iter().any(|column| column.role == Role::Group);
    let mut guess = Guess::among(if has_group { Vec::new() } else { unread });
    if !columns.is_empty() {
        table.notes.push(Note::IgnoredColumns { columns });
    }

    let mut numbers: HashMap<String, u32> = HashMap::new();
    let mut before = None;
    // Time of the last row of each group and id, and its piece.
    let mut latest: HashMap<(u32, u32), (f64, u32)> = HashMap::new();
    let mut pieces = 0;
    while let Some(line) = lines.next(problems)?.map(str::to_owned) {
        let mut fields: Vec<Field> = Vec::with_capacity(header.names.len());
        split_by(&line, separator, &mut fields);
        if fields.iter().all(|field| field.text.is_empty()) {
            continue;
        }
        table.terminated = lines.terminated;
        let expected = header.names.len();
        header.check_row(&fields, lines.number(), problems)?;
        let surplus = fields.iter().skip(expected).any(|field| !field.text.is_empty());
        if fields.len() < expected || surplus {
            let kind = ProblemKind::FieldCount { expected, found: fields.len(), last: !lines.terminated };
            problems.add(lines.number(), Some(1), kind);
            continue;
        }
        table.lines.push(lines.number());
        table.hashes.push(fingerprint(&line));
        let mut faulty = Vec::new();
        let (mut number, mut name) = (0, 0);
        for column in &wanted {
            let field = fields[column.place];
            if column.role.quantity().is_none() {
                let nobody = column.role == Role::Ahead && is_word_for_missing(field.text, map);
                let text = if nobody { "" } else { whole(field.text) };
                let next = table.dictionary.len() as u32;
                let known = numbers.get(text).copied();
                let id = known.unwrap_or_else(|| {
                    numbers.insert(text.to_owned(), next);
                    table.dictionary.push(text.to_owned());
                    next
                });
                table.names[name].1.push(id);
                name += 1;
                continue;
            }
            let mut value = value(field.text, &header.names[column.place], column, map).unwrap_or_else(|kind| {
                let problem = Problem { line: lines.number(), column: Some(column_of(&line, field.start)), kind };
                if column.role == Role::Time {
                    problems.add(problem.line, problem.column, problem.kind);
                } else {
                    faulty.push((Signal { car: column.car, is_gap: column.role.is_gap() }, problem));
                }
                f64::NAN
            });
            if column.form == Form::Clock && value.is_finite() {
                value = clock::going_on(value, before);
                before = Some(value);
            }
            table.numbers[number].1.push(value);
            number += 1;
        }
        let row = table.lines.len() - 1;
        let time = table.numbers(Role::Time).map_or(f64::NAN, |time| time[row]);
        guess.take(time, |place| fields[place].text);
        let (last, piece) = latest.entry(table.key(row)).or_insert((f64::NAN, 0));
        if !(0.0..=PAUSE_S).contains(&(time - *last)) {
            *piece = pieces;
            pieces += 1;
        }
        *last = time;
        table.pieces.push(*piece);
        for (signal, problem) in faulty {
            table.faults.entry((*piece, signal)).or_default().add(problem);
        }
    }
    table.guess = guess.names().into_iter().map(str::to_owned).collect();
    if problems.check().is_err() {
        table.refuse(problems)?;
    }
    match table.lines.len() {
        0 => Err(problems.stop(header.line.max(1), None, ProblemKind::NoRows)),
        1 => Err(problems.stop(table.lines[0], None, ProblemKind::OneRow)),
        _ => Ok(table),
    }
}

fn is_word_for_missing(text: &str, map: &ColumnMap) -> bool {
    // A program without missing numbers writes -999 as -999.0.
    let number = |text: &str| text.parse::<f64>().ok();
    let same =
        |word: &String| word.eq_ignore_ascii_case(text) || number(word).is_some_and(|word| number(text) == Some(word));
    is_missing(text) || map.missing.iter().any(same)
}

/// A number in SI, NaN if it is missing, or its fault.
fn value(text: &str, name: &str, column: &Wanted, map: &ColumnMap) -> Result<f64, ProblemKind> {
    let Wanted { role, form, unit, .. } = column;
    let text = if is_word_for_missing(text, map) { "" } else { text };
    let read = |text: &str| if *role == Role::Time { present(text, name) } else { finite(text, name) };
    let timed = |found: Option<f64>, expected: &'static str| match found {
        _ if text.is_empty() => Err(ProblemKind::Missing { column: name.to_owned() }),
        Some(time) => Ok(time),
        None => Err(ProblemKind::NotATime { column: name.to_owned(), expected, found: text.to_owned() }),
    };
    let factor = match form {
        Form::Factor(factor) => factor,
        Form::Days => &1.0,
        Form::Iso => return timed(clock::iso(text), "a date with a time, such as 2019-10-09T14:58:30.1Z"),
        Form::Clock => return timed(clock::of_day(text), "a time of day, such as 145830.1 or 14:58:30.1"),
    };
    let written = match map.decimal {
        Decimal::Point => read(text).map_err(|kind| match kind {
            ProblemKind::DecimalComma { column, found, .. } => {
                ProblemKind::DecimalComma { column, found, mapped: map.separator != Separator::Comma }
            }
            // A clock is not a number.
            ProblemKind::NotANumber { column, found, .. } if *role == Role::Time && is_time(&found) => {
                ProblemKind::TimeUnit { column, found }
            }
            kind => kind,
        })?,
        // With decimal commas a point may be a separator of thousands.
        Decimal::Comma if text.contains('.') => {
            return Err(ProblemKind::DecimalPoint { column: name.to_owned(), found: text.to_owned() });
        }
        Decimal::Comma => read(&text.replace(',', "."))?,
    };
    let si = if *form == Form::Days { clock::of_days(written) } else { written * factor };
    if role.quantity() == Some(Quantity::Speed) && si.abs() > SPEED_LIMIT {
        return Err(ProblemKind::MappedSpeed {
            column: name.to_owned(),
            unit: unit.clone(),
            limit: SPEED_LIMIT / factor,
            found: written,
        });
    }
    Ok(si)
}

fn is_time(text: &str) -> bool {
    clock::iso(text).is_some() || (text.contains(':') && clock::of_day(text).is_some())
}

fn split_by<'a>(line: &'a str, separator: Separator, fields: &mut Vec<Field<'a>>) {
    match separator {
        Separator::Comma => split_at(line, ',', fields),
        Separator::Semicolon => split_at(line, ';', fields),
        Separator::Tab => split_at(line, '\t', fields),
        Separator::Whitespace => {
            fields.clear();
            let place = |text: &str| text.as_ptr() as usize - line.as_ptr() as usize;
            fields.extend(line.split_whitespace().map(|text| Field { text, start: place(text) }));
        }
    }
}
