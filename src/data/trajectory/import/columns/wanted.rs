//! Which columns of a file a map reads.

use super::map::ColumnMap;
use super::role::Role;
use super::text::Fixed;
use super::text::Rows;
use super::unit::Form;
use crate::trajectory::import::header::{Header, nearest};
use crate::trajectory::import::problems::Problems;
use std::collections::BTreeSet;

/// One column of the file that is read.
pub(super) struct Wanted {
    pub place: usize,
    pub role: Role,
    /// Of a platoon, or the place among the names of a layout; 0 elsewhere.
    pub car: usize,
    pub form: Form,
    pub unit: String,
}

/// The columns that the map names, in its order and that of the cars of a platoon, and the places of the columns that it does not know.
pub(super) fn wanted(header: &Header, map: &ColumnMap, problems: &mut Problems) -> (Vec<Wanted>, Vec<usize>) {
    let find = |name: &str| match map.layout {
        Some(_) => header.find(name),
        None => header.find_in_any_case(name),
    };
    let cars = cars(header, map, find);
    let mut wanted = Vec::new();
    for column in &map.columns {
        let is_of_a_car = map.rows == Rows::Platoon && column.role.is_of_a_car();
        for (position, &car) in (if is_of_a_car { cars.as_slice() } else { &[0] }).iter().enumerate() {
            // Except in a layout, cars count from 1, whatever the numbers in the file.
            let (own, ahead) = match map.layout {
                Some(_) => (car, car.checked_sub(1).filter(|ahead| *ahead > 0)),
                None => (position + 1, position.checked_sub(1).map(|ahead| cars[ahead])),
            };
            let named = column.names.iter().filter_map(|name| numbered(name, car, ahead));
            let place = named.into_iter().find_map(|name| find(&name));
            let car = if is_of_a_car { own } else { 0 };
            let (role, form) = (column.role, column.form);
            wanted.extend(place.map(|place| Wanted { place, role, car, form, unit: column.unit.clone() }));
        }
    }
    match &map.layout {
        Some(layout) => {
            let names = layout.names.iter().enumerate().filter_map(|(car, name)| Some((car, find(name)?)));
            let (role, form) = (Role::Name, Form::Factor(1.0));
            wanted.extend(names.map(|(car, place)| Wanted { place, role, car, form, unit: String::new() }));
            Names { map, layout, cars: &cars }.check(header, problems);
        }
        None => check(header, map, &wanted, problems),
    }
    let is_read = |place: usize| wanted.iter().any(|column| column.place == place);
    let is_known = |name| map.layout.as_ref().is_some_and(|layout| Names { map, layout, cars: &cars }.has(name));
    let unknown = (0..header.names.len())
        .filter(|&place| !is_read(place) && !header.names[place].is_empty() && !is_known(&header.names[place]));
    let unknown = unknown.collect();
    (wanted, unknown)
}

/// Records the columns that the file lacks.
fn check(header: &Header, map: &ColumnMap, wanted: &[Wanted], problems: &mut Problems) {
    let all: Vec<&str> = map.columns.iter().flat_map(|column| column.names.iter().map(String::as_str)).collect();
    let needed: Vec<&str> = map.columns.iter().filter(|c| !c.optional).map(|c| c.names[0].as_str()).collect();
    let is_there = |role: Role| wanted.iter().any(|column| column.role == role);
    let missing = || map.columns.iter().filter(|column| !column.optional && !is_there(column.role));
    let mut hints: Vec<&str> = Vec::new();
    for column in missing().filter(|column| !column.hint.is_empty()) {
        if !hints.contains(&column.hint.as_str()) {
            hints.push(&column.hint);
        }
    }
    let missing: Vec<&str> = missing().map(|column| column.names[0].as_str()).collect();
    // One name may be misspelt; if several are missing, the table may be another one.
    let other = format!("is {} the right column map? `leadlag list columns` shows those that are built in", map.name);
    let advice = match hints.as_slice() {
        [] if missing.len() > 1 => other,
        hints => hints.join("; "),
    };
    header.missing(&missing, &needed, &all, &advice, problems);
}

/// The names of the columns of a layout, in a file with these cars.
pub(super) struct Names<'a> {
    pub map: &'a ColumnMap,
    pub layout: &'a Fixed,
    pub cars: &'a [usize],
}

impl Names<'_> {
    /// True for the name of a column, of any car if not every car has all.
    fn has(&self, name: &str) -> bool {
        let columns = self.map.columns.iter().flat_map(|column| &column.names);
        columns.chain(&self.layout.names).chain(&self.layout.unread).any(|known| match known.contains('{') {
            true => number(known, name).is_some_and(|car| !self.layout.every_car || self.cars.contains(&car)),
            false => known == name,
        })
    }

    /// The names of the columns that are read of some cars, each with the place of its column in the map.
    fn of(&self, cars: &[usize]) -> Vec<(usize, String)> {
        let named = |(place, column): (usize, &super::map::Column)| {
            let is_of_a_car = self.map.rows == Rows::Platoon && column.role.is_of_a_car();
            let cars: &[usize] = if is_of_a_car { cars } else { &[0] };
            let behind = cars.iter().filter(move |&&car| !is_of_a_car || car > 1 || !column.role.is_gap());
            let names = behind.filter_map(|&car| numbered(&column.names[0], car, car.checked_sub(1)));
            names.map(|name| (place, name)).collect::<Vec<_>>()
        };
        self.map.columns.iter().enumerate().flat_map(named).collect()
    }

    /// All names that are typical of the layout.
    pub fn typical(&self) -> Vec<String> {
        let names = self.of(self.cars).into_iter().map(|(_, name)| name);
        let others = self.layout.names.iter().chain(&self.layout.unread).filter(|name| !name.contains('{'));
        names.chain(others.cloned()).collect()
    }

    /// Records the columns that the file lacks, and those that are misspelt.
    fn check(&self, header: &Header, problems: &mut Problems) {
        let columns = &self.map.columns;
        // Then any set of cars is valid: of each column as many must be there as two cars have.
        let any_car = self.map.rows == Rows::Platoon && !self.layout.every_car;
        let names = self.of(if any_car { &[1, 2] } else { self.cars });
        let needed = || names.iter().filter(|(place, _)| !columns[*place].optional);
        if any_car {
            self.suspect(header, problems);
        }
        let misspelt = any_car && problems.check().is_err();
        let found = |form: &str| header.names.iter().filter(|name| number(form, name).is_some()).count();
        let mut left: Vec<usize> = columns.iter().map(|column| found(&column.names[0])).collect();
        let is_missing = |(place, name): &&(usize, String)| {
            if !any_car || !columns[*place].names[0].contains('{') {
                return header.find(name).is_none();
            }
            let lacks = left[*place] == 0;
            left[*place] = left[*place].saturating_sub(1);
            lacks && !misspelt
        };
        let missing: Vec<&str> = needed().filter(is_missing).map(|(_, name)| name.as_str()).collect();
        let needed: Vec<&str> = needed().map(|(_, name)| name.as_str()).collect();
        let known: Vec<&str> = header.names.iter().map(String::as_str).filter(|name| self.has(name)).collect();
        header.missing(&missing, &needed, &known, &self.layout.hint, problems);
        if !any_car {
            let known = self.typical();
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            header.unknown(&needed, &known, problems);
        }
    }

    /// Records names with a number that are almost those of a column that is needed.
    fn suspect(&self, header: &Header, problems: &mut Problems) {
        let word = |name: &str| name.replace("{-1}", "").replace("{}", "");
        let needed = self.map.columns.iter().filter(|column| !column.optional && column.names[0].contains('{'));
        let words: Vec<String> = needed.map(|column| word(&column.names[0])).collect();
        for (place, name) in header.names.iter().enumerate().filter(|(_, name)| !self.has(name)) {
            let signal = name.trim_end_matches(|c: char| c.is_ascii_digit());
            if let Some(near) =
                nearest(signal, words.iter().map(String::as_str)).filter(|near| *near != signal && signal != name)
            {
                header.suspect(place, &format!("{near}{}", &name[signal.len()..]), problems);
            }
        }
    }
}

/// The numbers of the cars of a platoon: those with a speed or, if every car has all columns, those in a row with any.
fn cars(header: &Header, map: &ColumnMap, find: impl Fn(&str) -> Option<usize>) -> Vec<usize> {
    if map.rows != Rows::Platoon {
        return Vec::new();
    }
    let has = |column: &super::map::Column, car: usize| {
        column.names.iter().filter_map(|name| numbered(name, car, None)).any(|name| find(&name).is_some())
    };
    let own = |role: Role| role.is_of_a_car() && !role.is_gap();
    let speed = |car: &usize| map.column(Role::Speed).is_some_and(|column| has(column, *car));
    if map.layout.as_ref().is_some_and(|layout| layout.every_car) {
        let any = |car: &usize| map.columns.iter().any(|c| own(c.role) && !c.optional && has(c, *car));
        let count = (1..).take_while(any).count();
        return (1..=count.max(2)).collect();
    }
    let digits = header.names.iter().flat_map(|name| name.split(|c: char| !c.is_ascii_digit()));
    let numbers: BTreeSet<usize> = digits.filter_map(|digits| digits.parse().ok()).collect();
    numbers.into_iter().filter(|&car| map.layout.is_none() || car > 0).filter(speed).collect()
}

/// The name of a column of one car: `{}` is its number, `{-1}` that of the car ahead. `None` without a car ahead.
fn numbered(name: &str, car: usize, ahead: Option<usize>) -> Option<String> {
    if name.contains("{-1}") {
        return Some(name.replace("{-1}", &ahead?.to_string()).replace("{}", &car.to_string()));
    }
    Some(name.replace("{}", &car.to_string()))
}

/// The number in a name of this form, from 1.
fn number(form: &str, name: &str) -> Option<usize> {
    let (before, after) = form.split_once('{')?;
    let digits = name.strip_prefix(before)?.strip_suffix(after.split_once('}')?.1)?;
    let is_number = digits.bytes().all(|b| b.is_ascii_digit());
    digits.parse().ok().filter(|&number| is_number && number > 0)
}
