//! The rows of a mapped table: numbers in SI, names as they are.

use super::map::{ColumnMap, Decimal, Separator};
use super::role::Role;
use super::unit::Quantity;
use crate::trajectory::error::ProblemKind;
use crate::trajectory::import::header::{Field, Header, check_names, check_separator, column_of, split_at};
use crate::trajectory::import::lines::Lines;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::import::table::{finite, present};
use std::collections::HashMap;
use std::io::Read;

/// A speed above this is in another unit \[m/s\] (324 km/h).
const SPEED_LIMIT: f64 = 90.0;

/// All rows, by role.
pub(super) struct Table {
    /// Line of the header, for messages about the whole table.
    pub header_line: u64,
    /// Line of each row.
    pub lines: Vec<u64>,
    numbers: Vec<(Role, Vec<f64>)>,
    names: Vec<(Role, Vec<u32>)>,
    /// Names by number.
    pub dictionary: Vec<String>,
    /// Columns that were not read.
    pub ignored: Vec<String>,
    /// False if the last row has no line end.
    pub terminated: bool,
    /// What each role is called in this file.
    called: Vec<(Role, String)>,
}

impl Table {
    pub fn numbers(&self, role: Role) -> Option<&[f64]> {
        self.numbers.iter().find(|(r, _)| *r == role).map(|(_, values)| values.as_slice())
    }

    pub fn names(&self, role: Role) -> Option<&[u32]> {
        self.names.iter().find(|(r, _)| *r == role).map(|(_, values)| values.as_slice())
    }

    /// `NAME (UNIT)` of a role, for messages.
    pub fn called(&self, role: Role) -> String {
        self.called.iter().find(|(r, _)| *r == role).map_or_else(String::new, |(_, name)| name.clone())
    }
}

/// One column of the file that is read.
struct Wanted {
    place: usize,
    role: Role,
    factor: f64,
    unit: String,
}

/// Reads all rows; problems are collected.
pub(super) fn read<R: Read>(lines: &mut Lines<R>, map: &ColumnMap, problems: &mut Problems) -> Result<Table, Stop> {
    let header = match &map.header {
        Some(names) => Header::named(names),
        None => {
            let Some(first) = lines.next(problems)?.map(str::to_owned) else {
                return Err(problems.stop(1, None, ProblemKind::Empty));
            };
            if map.separator == Separator::Comma {
                check_separator(&first, 1, true, problems)?;
            }
            let mut fields = Vec::new();
            split_by(&first, map.separator, &mut fields);
            check_names(&fields, problems)?;
            Header::of(&first, 1, &fields, problems)?
        }
    };
    let wanted = wanted(&header, map, problems);
    problems.check()?;
    let mut table = Table {
        header_line: header.line,
        lines: Vec::new(),
        numbers: Vec::new(),
        names: Vec::new(),
        dictionary: Vec::new(),
        ignored: Vec::new(),
        terminated: true,
        called: Vec::new(),
    };
    for column in &wanted {
        match column.role.quantity() {
            Some(_) => table.numbers.push((column.role, Vec::new())),
            None => table.names.push((column.role, Vec::new())),
        }
        let name = &header.names[column.place];
        let unit = if column.unit.is_empty() { String::new() } else { format!(" ({})", column.unit) };
        table.called.push((column.role, format!("{name}{unit}")));
    }
    let is_read = |place: usize| wanted.iter().any(|column| column.place == place);
    let unread = header.names.iter().enumerate().filter(|(place, name)| !is_read(*place) && !name.is_empty());
    table.ignored = unread.map(|(_, name)| name.clone()).collect();

    let mut numbers: HashMap<String, u32> = HashMap::new();
    while let Some(line) = lines.next(problems)?.map(str::to_owned) {
        let mut fields: Vec<Field> = Vec::with_capacity(header.names.len());
        split_by(&line, map.separator, &mut fields);
        if fields.iter().all(|field| field.text.is_empty()) {
            continue;
        }
        table.terminated = lines.terminated;
        let expected = header.names.len();
        let surplus = fields.iter().skip(expected).any(|field| !field.text.is_empty());
        if fields.len() < expected || surplus {
            let kind = ProblemKind::FieldCount { expected, found: fields.len(), last: !lines.terminated };
            problems.add(lines.number(), Some(1), kind);
            continue;
        }
        table.lines.push(lines.number());
        let (mut number, mut name) = (0, 0);
        for column in &wanted {
            let field = fields[column.place];
            if column.role.quantity().is_none() {
                let next = table.dictionary.len() as u32;
                let known = numbers.get(field.text).copied();
                let id = known.unwrap_or_else(|| {
                    numbers.insert(field.text.to_owned(), next);
                    table.dictionary.push(field.text.to_owned());
                    next
                });
                table.names[name].1.push(id);
                name += 1;
                continue;
            }
            let value = value(field.text, &header.names[column.place], column, map).unwrap_or_else(|kind| {
                problems.add(lines.number(), Some(column_of(&line, field.start)), kind);
                f64::NAN
            });
            table.numbers[number].1.push(value);
            number += 1;
        }
    }
    problems.check()?;
    match table.lines.len() {
        0 => Err(problems.stop(header.line.max(1), None, ProblemKind::NoRows)),
        1 => Err(problems.stop(table.lines[0], None, ProblemKind::OneRow)),
        _ => Ok(table),
    }
}

/// The columns that the map names, in the order of its roles.
fn wanted(header: &Header, map: &ColumnMap, problems: &mut Problems) -> Vec<Wanted> {
    let mut wanted = Vec::new();
    let all: Vec<&str> = map.columns.iter().flat_map(|column| column.names.iter().map(String::as_str)).collect();
    let needed: Vec<&str> =
        map.columns.iter().filter(|c| !c.optional).filter_map(|c| c.names.first().map(String::as_str)).collect();
    let mut missing = Vec::new();
    for column in &map.columns {
        match column.names.iter().find_map(|name| header.find(name)) {
            Some(place) => {
                wanted.push(Wanted { place, role: column.role, factor: column.factor, unit: column.unit.clone() });
            }
            None if column.optional => {}
            None => missing.push(column.names[0].as_str()),
        }
    }
    // One name may be misspelt; when several are missing, the table may be another one.
    let advice = format!("is {} the right column map? `leadlag list columns` shows those that are built in", map.name);
    header.missing(&missing, &needed, &all, if missing.len() > 1 { &advice } else { "" }, problems);
    wanted
}

/// A number in SI, NaN if it is missing, or what is wrong with it.
fn value(text: &str, name: &str, column: &Wanted, map: &ColumnMap) -> Result<f64, ProblemKind> {
    let Wanted { role, factor, unit, .. } = column;
    let read = |text: &str| if *role == Role::Time { present(text, name) } else { finite(text, name) };
    let written = match map.decimal {
        Decimal::Point => read(text).map_err(|kind| match kind {
            ProblemKind::DecimalComma { column, found, .. } => {
                ProblemKind::DecimalComma { column, found, mapped: map.separator != Separator::Comma }
            }
            kind => kind,
        })?,
        // Beside decimal commas a point may as well separate thousands.
        Decimal::Comma if text.contains('.') => {
            return Err(ProblemKind::DecimalPoint { column: name.to_owned(), found: text.to_owned() });
        }
        Decimal::Comma => read(&text.replace(',', "."))?,
    };
    let si = written * factor;
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
