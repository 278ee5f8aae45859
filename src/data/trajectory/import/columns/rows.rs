//! The rows of a table: numbers in SI, names unchanged.

use super::clock;
use super::guess::Guess;
use super::map::{ColumnMap, whole};
use super::role::Role;
use super::text::{Decimal, Rows, Separator};
use super::trajectory::{Row, Trajectories};
use super::unit::{Form, Quantity};
use super::wanted::{Wanted, wanted};
use crate::trajectory::error::{Faults, Problem, ProblemKind};
use crate::trajectory::import::driver_modes;
use crate::trajectory::import::header::{Field, Header, check_names, check_separator, column_of, split_at};
use crate::trajectory::import::lines::Lines;
use crate::trajectory::import::number::{SPEED_LIMIT, fingerprint, finite, is_missing, present};
use crate::trajectory::import::preamble;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::steps::PAUSE_S;
use crate::trajectory::{Note, Platoon};
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
    names: Vec<((Role, usize), Vec<u32>)>,
    /// Names by number.
    pub dictionary: Vec<String>,
    /// Key that distinguishes rows of equal times.
    hashes: Vec<u64>,
    /// Number of the piece that each row belongs to: a trajectory or, in a table of vehicles, rows of one group and id whose time
    /// continues without a pause.
    pub pieces: Vec<u32>,
    /// Faults of single values, by piece and signal.
    faults: BTreeMap<(u32, Signal), Faults>,
    /// The first distance of each piece that is not above 0, in a layout.
    not_above: BTreeMap<(u32, Role, usize), Problem>,
    /// Changes while reading: lines and columns that were not read.
    pub notes: Vec<Note>,
    /// Columns that were not read.
    ignored: Option<Note>,
    /// The last line, if it has no end.
    open_end: Option<u64>,
    /// Rows of trajectories that repeat another one exactly, and are left out.
    repeated: Repeated,
    /// True for a layout, which names columns without their units.
    is_layout: bool,
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
        self.names_of(role, 0)
    }

    fn names_of(&self, role: Role, car: usize) -> Option<&[u32]> {
        self.names.iter().find(|(key, _)| *key == (role, car)).map(|(_, values)| values.as_slice())
    }

    /// The name that completes the cars of a layout, by its place there.
    pub fn name(&self, place: usize, row: usize) -> &str {
        self.names_of(Role::Name, place).map_or("", |names| &self.dictionary[names[row] as usize])
    }

    /// Who drives car `car` in these rows by the column of car `column`, and who takes over.
    pub fn drivers(&self, rows: &[usize], column: usize, car: usize) -> Vec<Note> {
        let names = self.names_of(Role::Driver, column);
        let (Some(names), Some(time)) = (names, self.numbers(Role::Time)) else { return Vec::new() };
        driver_modes(car, rows.iter().map(|&row| (time[row], self.dictionary[names[row] as usize].as_str())))
    }

    /// Notes and counts distances that are not above 0, as missing values. Where none is above 0, a column of a layout has another sign, or
    /// another meaning: a fault. `name` is that of the signal without a layout.
    pub fn above_0(&self, gap: Vec<f64>, rows: &[usize], of: (Role, usize), car: usize, name: &str) -> Gap {
        let samples = gap.iter().filter(|&&gap| gap <= 0.0).count();
        let signal = if self.is_layout { self.called_of(of.0, of.1) } else { name.to_owned() };
        let mut faults = Faults::default();
        if !gap.iter().any(|&gap| gap > 0.0) {
            self.not_above.get(&(self.pieces[rows[0]], of.0, of.1)).cloned().into_iter().for_each(|p| faults.add(p));
        }
        Gap {
            values: gap.into_iter().map(|gap| if gap > 0.0 { gap } else { f64::NAN }).collect(),
            note: (samples > 0).then_some(Note::NoGap { car, signal, samples }),
            faults,
        }
    }

    /// Adds the changes of the whole table to the notes of its first trajectory.
    pub fn note(&self, first: &mut Platoon) {
        first.notes.splice(0..0, self.notes.iter().cloned().chain(self.repeated.note()));
        self.note_rest(&mut first.notes);
    }

    /// Columns that were not read, and a last line without an end, which may have lost digits.
    pub fn note_rest(&self, notes: &mut Vec<Note>) {
        notes.extend(self.ignored.clone());
        notes.extend(self.open_end.map(|line| Note::OpenEnd { line }));
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

/// Distances of the vehicle ahead.
pub(super) struct Gap {
    pub values: Vec<f64>,
    pub note: Option<Note>,
    pub faults: Faults,
}

/// Rows that occur more than once in a table.
#[derive(Debug, Clone, Default)]
pub(super) struct Repeated {
    rows: usize,
    first: u64,
}

impl Repeated {
    pub fn add(&mut self, line: u64) {
        self.first = if self.rows == 0 { line } else { self.first.min(line) };
        self.rows += 1;
    }

    pub fn note(&self) -> Option<Note> {
        (self.rows > 0).then_some(Note::RowsRepeated { rows: self.rows, line: self.first })
    }
}

/// The header, and the separator of the fields below it.
pub(super) fn header<R: Read>(
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

/// Skips the row of units behind a header, if there is one, or the map announces one. In a layout they must be the units of the columns.
fn units_row<R: Read>(
    lines: &mut Lines<R>,
    map: &ColumnMap,
    below: &Below,
    problems: &mut Problems,
) -> Result<Option<Note>, Stop> {
    let Some(line) = lines.next(problems)?.map(str::to_owned) else {
        return Ok(None);
    };
    let mut fields = Vec::new();
    split_by(&line, below.separator, &mut fields);
    if !map.units_row && !preamble::is_units(&fields) {
        lines.unread();
        return Ok(None);
    }
    for column in below.wanted.iter().filter(|_| map.layout.is_some()) {
        let Some(field) = fields.get(column.place).filter(|field| !field.text.is_empty()) else { continue };
        let expected = column.role.quantity().map_or(&[][..], Quantity::written);
        if !expected.is_empty() && !expected.contains(&preamble::bare(field.text).as_str()) {
            let (column, found) = (below.header.names[column.place].clone(), field.text.to_owned());
            let kind = ProblemKind::OtherUnit { column, expected: expected[0], found };
            problems.add(lines.number(), Some(column_of(&line, field.start)), kind);
        }
    }
    problems.check()?;
    let what = format!("units, {}", line.trim());
    Ok(Some(Note::LinesSkipped { line: lines.number(), lines: 1, what }))
}

/// What stands below a header.
struct Below {
    header: Header,
    separator: Separator,
    wanted: Vec<Wanted>,
}

/// Reads all rows below a header; problems are collected. `notes` say what was skipped before.
pub(super) fn read<R: Read>(
    lines: &mut Lines<R>,
    (header, separator): (Header, Separator),
    map: &ColumnMap,
    mut notes: Vec<Note>,
    problems: &mut Problems,
) -> Result<Table, Stop> {
    let (wanted, unknown) = wanted(&header, map, problems);
    problems.check()?;
    let below = Below { header, separator, wanted };
    if below.header.line > 0 {
        notes.extend(units_row(lines, map, &below, problems)?);
    }
    let Below { header, wanted, .. } = &below;
    let unread: Vec<(usize, String)> = unknown.iter().map(|&place| (place, header.names[place].clone())).collect();
    let columns: Vec<String> = unread.iter().map(|(_, name)| name.clone()).collect();
    let mut table = Table {
        header_line: header.line,
        lines: Vec::new(),
        numbers: Vec::new(),
        names: Vec::new(),
        dictionary: Vec::new(),
        hashes: Vec::new(),
        pieces: Vec::new(),
        faults: BTreeMap::new(),
        not_above: BTreeMap::new(),
        notes,
        ignored: (!columns.is_empty()).then_some(Note::IgnoredColumns { columns }),
        open_end: None,
        repeated: Repeated::default(),
        is_layout: map.layout.is_some(),
        called: Vec::new(),
    };
    lines.keep(wanted.len());
    for column in wanted {
        match column.role.quantity() {
            Some(_) => table.numbers.push(((column.role, column.car), Vec::new())),
            None => table.names.push(((column.role, column.car), Vec::new())),
        }
        let name = &header.names[column.place];
        let is_bare = table.is_layout || column.unit.is_empty();
        let unit = if is_bare { String::new() } else { format!(" ({})", column.unit) };
        table.called.push(((column.role, column.car), format!("{name}{unit}")));
    }
    let time = wanted.iter().find(|column| column.role == Role::Time).expect("a map without it is refused");
    let group = wanted.iter().find(|column| column.role == Role::Group);
    let is_certain = group.is_some() || table.is_layout;
    let mut guess = Guess::among(if is_certain { Vec::new() } else { unread });
    let mut numbers: HashMap<String, u32> = HashMap::new();
    let mut before = None;
    let mut trajectories = Trajectories::new(table.called(Role::Time), group.is_some(), is_certain);
    // Time of the last row of each group and id, and its piece.
    let mut latest: HashMap<(u32, u32), (f64, u32)> = HashMap::new();
    let mut pieces = 0;
    while let Some(line) = lines.next(problems)?.map(str::to_owned) {
        let mut fields: Vec<Field> = Vec::with_capacity(header.names.len());
        split_by(&line, separator, &mut fields);
        if fields.iter().all(|field| field.text.is_empty()) {
            continue;
        }
        table.open_end = (!lines.terminated).then_some(lines.number());
        let expected = header.names.len();
        header.check_row(&fields, lines.number(), problems)?;
        let surplus = fields.iter().skip(expected).any(|field| !field.text.is_empty());
        if fields.len() < expected || surplus {
            let kind = ProblemKind::FieldCount { expected, found: fields.len(), last: !lines.terminated };
            problems.add(lines.number(), Some(1), kind);
            continue;
        }
        let at = |column: &Wanted| Some(column_of(&line, fields[column.place].start));
        let hash = fingerprint(&line);
        let mut now = value(fields[time.place].text, &header.names[time.place], time, map).unwrap_or_else(|kind| {
            problems.add(lines.number(), at(time), kind);
            f64::NAN
        });
        if time.form == Form::Clock && now.is_finite() {
            now = clock::going_on(now, before);
            before = Some(now);
        }
        guess.take(now, |place| fields[place].text);
        let mut piece = 0;
        if map.rows != Rows::Vehicles {
            let row = Row { time: now, line: lines.number(), column: at(time), hash };
            let group = group.map_or("", |group| whole(fields[group.place].text));
            match trajectories.add(row, group, || guess.names().is_empty(), problems)? {
                Some(found) => piece = found,
                None => {
                    table.repeated.add(lines.number());
                    continue;
                }
            }
        }
        table.lines.push(lines.number());
        table.hashes.push(hash);
        let mut faulty = Vec::new();
        let (mut number, mut name) = (0, 0);
        for column in wanted {
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
            let found = match column.role {
                Role::Time => Ok(now),
                _ => value(field.text, &header.names[column.place], column, map),
            };
            let found = found.unwrap_or_else(|kind| {
                let problem = Problem { line: lines.number(), column: at(column), kind };
                faulty.push((Signal { car: column.car, is_gap: column.role.is_gap() }, problem));
                f64::NAN
            });
            if table.is_layout && column.role.is_distance() && found <= 0.0 {
                let key = (piece, column.role, column.car);
                table.not_above.entry(key).or_insert_with(|| Problem {
                    line: lines.number(),
                    column: at(column),
                    kind: ProblemKind::Spacing { column: header.names[column.place].clone(), found },
                });
            }
            table.numbers[number].1.push(found);
            number += 1;
        }
        if map.rows == Rows::Vehicles {
            let (last, its) = latest.entry(table.key(table.lines.len() - 1)).or_insert((f64::NAN, 0));
            if !(0.0..=PAUSE_S).contains(&(now - *last)) {
                *its = pieces;
                pieces += 1;
            }
            *last = now;
            piece = *its;
        }
        table.pieces.push(piece);
        for (signal, problem) in faulty {
            table.faults.entry((piece, signal)).or_default().add(problem);
        }
    }
    trajectories.finish(guess.names(), problems)?;
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
            ProblemKind::NotANumber { column, found, .. }
                if *role == Role::Time && map.layout.is_none() && is_time(&found) =>
            {
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
    if map.layout.is_some() {
        return role.limit(name, si).map_or(Ok(si), Err);
    }
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
