//! OpenACC files, original or rebuilt: five metadata lines, then columns in any order and number.

use super::header::{Header, nearest, split};
use super::lines::Lines;
use super::problems::{Problems, Stop};
use super::table::{Meaning, Table, WHOLE, Wanted, read_rows};
use crate::trajectory::error::ProblemKind;
use crate::trajectory::{Car, Layout, Note, Platoon};
use std::collections::BTreeMap;
use std::io::Read;

/// First words of the metadata lines, in file order.
const METADATA: [&str; 5] = ["Date", "Vehicle_order", "Number_of_vehicles", "ACC", "Distance_setting"];

/// Prefixes of the number of a car (IVS: of the front car of a gap) in a column name.
const SIGNALS: [&str; 12] = ["Speed", "IVS", "Driver", "Lat", "Lon", "Alt", "E", "N", "U", "VE", "VN", "VU"];

/// Reads the file whose first line is `first`; also returns which of the two layouts it has.
pub(super) fn read<R: Read>(
    first: String,
    lines: &mut Lines<R>,
    problems: &mut Problems,
    skipped: &mut Vec<Note>,
) -> Result<(Layout, Vec<Platoon>), Stop> {
    let mut fields = Vec::new();
    split(&first, &mut fields);
    // The metadata name the cars; the rest of them is not needed.
    if fields.iter().any(|field| field.text.eq_ignore_ascii_case("Time")) {
        let header = Header::parse(&first, lines.number(), problems)?;
        return table(&header, &[], lines, problems, skipped);
    }
    let names = metadata(first, lines, problems)?;
    let Some(text) = lines.next(problems)? else {
        return Err(problems.stop(METADATA.len() as u64, None, ProblemKind::NoHeader));
    };
    let text = text.to_owned();
    let header = Header::parse(&text, lines.number(), problems)?;
    table(&header, &names, lines, problems, skipped)
}

/// The platoon below a header; also returns which of the two layouts it has.
fn table<R: Read>(
    header: &Header,
    names: &[String],
    lines: &mut Lines<R>,
    problems: &mut Problems,
    skipped: &mut Vec<Note>,
) -> Result<(Layout, Vec<Platoon>), Stop> {
    let columns = Columns::find(header, problems);
    problems.check()?;
    let table = read_rows(lines, header, &columns.wanted(), problems, skipped)?;
    let has_positions = header.names.iter().any(|name| {
        let (signal, number) = signal_and_number(name);
        number.is_some() && !matches!(signal, "Speed" | "IVS" | "Driver")
    });
    let layout = if has_positions { Layout::OpenAcc } else { Layout::AstazeroRebuilt };
    let platoon = columns.platoon(&table, names);
    if !platoon.is_usable() {
        table.refuse(problems)?;
    }
    Ok((layout, vec![platoon]))
}

/// Names of the cars, from the metadata.
fn metadata<R: Read>(first: String, lines: &mut Lines<R>, problems: &mut Problems) -> Result<Vec<String>, Stop> {
    let mut names = Vec::new();
    let mut line = first;
    for (index, expected) in METADATA.into_iter().enumerate() {
        if index > 0 {
            line = match lines.next(problems)? {
                Some(text) => text.to_owned(),
                None => String::new(),
            };
        }
        let mut fields = Vec::new();
        split(&line, &mut fields);
        if !fields[0].text.eq_ignore_ascii_case(expected) {
            let kind = ProblemKind::Metadata { expected, found: line };
            return Err(problems.stop(lines.number().max(index as u64 + 1), Some(1), kind));
        }
        if expected == "Vehicle_order" {
            names = fields[1..].iter().map(|f| f.text.to_owned()).collect();
        }
    }
    Ok(names)
}

/// `IVS12` is (`IVS`, 12); a name without a number (or with one that is too large) has none.
fn signal_and_number(name: &str) -> (&str, Option<usize>) {
    let signal = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = name[signal.len()..].parse().ok();
    (signal, number.filter(|&n| n > 0 && n < 10_000))
}

fn is_known(name: &str) -> bool {
    let (signal, number) = signal_and_number(name);
    name.is_empty() || name == "Time" || (number.is_some() && SIGNALS.contains(&signal))
}

/// Positions of the used columns: car number to column.
struct Columns {
    time: usize,
    speed: BTreeMap<usize, usize>,
    gap: BTreeMap<usize, usize>,
    driver: BTreeMap<usize, usize>,
    ignored: Vec<String>,
}

impl Columns {
    fn find(header: &Header, problems: &mut Problems) -> Self {
        let mut columns = Columns {
            time: header.find("Time").unwrap_or_default(),
            speed: BTreeMap::new(),
            gap: BTreeMap::new(),
            driver: BTreeMap::new(),
            ignored: Vec::new(),
        };
        for (index, name) in header.names.iter().enumerate() {
            match signal_and_number(name) {
                ("Speed", Some(car)) => drop(columns.speed.insert(car, index)),
                ("IVS", Some(car)) => drop(columns.gap.insert(car + 1, index)),
                ("Driver", Some(car)) => drop(columns.driver.insert(car, index)),
                _ if is_known(name) => {}
                (signal, Some(car)) => match nearest(signal, ["Speed", "IVS"].into_iter()) {
                    Some(near) => header.suspect(index, &format!("{near}{car}"), problems),
                    None => columns.ignored.push(name.clone()),
                },
                _ => columns.ignored.push(name.clone()),
            }
        }
        let needed = ["Time", "Speed1", "Speed2", "IVS1"];
        // Any set of cars is valid, so only the lack of all is an error; a misspelt column has been reported.
        let known: Vec<&str> = header.names.iter().map(String::as_str).collect();
        let known: Vec<&str> = known.into_iter().filter(|name| is_known(name)).collect();
        let misspelt = problems.check().is_err();
        let lacking = [
            header.find("Time").is_none(),
            !misspelt && columns.speed.is_empty(),
            !misspelt && columns.speed.len() < 2,
            !misspelt && columns.gap.is_empty(),
        ];
        let lacking = needed.iter().zip(lacking).filter(|(_, lacking)| *lacking);
        let missing: Vec<&str> = lacking.map(|(column, _)| *column).collect();
        header.missing(&missing, &needed, &known, "", problems);
        columns
    }

    fn wanted(&self) -> Wanted {
        let mut numbers = vec![(self.time, Meaning::Time)];
        numbers.extend(self.speed.values().map(|&c| (c, Meaning::Speed)));
        numbers.extend(self.gap.values().map(|&c| (c, Meaning::Spacing)));
        Wanted { numbers, texts: self.driver.values().copied().collect(), group: None }
    }

    fn platoon(&self, table: &Table, names: &[String]) -> Platoon {
        // In the order of `wanted`: the time, the speeds, the gaps.
        let t = table.numbers[0].clone();
        let gaps: BTreeMap<usize, usize> = self.gap.keys().copied().zip(1 + self.speed.len()..).collect();
        let mut notes: Vec<Note> = table.repeated.clone().into_iter().collect();
        let mut cars = Vec::with_capacity(self.speed.len());
        for (&number, place) in self.speed.keys().zip(1..) {
            let gap = gaps.get(&number).copied();
            cars.push(Car {
                gap: gap.map(|gap| table.numbers[gap].clone()),
                v: table.numbers[place].clone(),
                faults: table.faults(WHOLE, place),
                gap_faults: gap.map(|gap| table.faults(WHOLE, gap)).unwrap_or_default(),
                ..Car::new(number, names.get(number - 1).map(String::as_str))
            });
            notes.extend(gap.and_then(|gap| table.no_gap(WHOLE, gap, number, &format!("IVS{}", number - 1))));
        }
        for (&car, changes) in self.driver.keys().zip(&table.texts) {
            notes.extend(super::driver_modes(car, changes.iter().map(|(row, mode)| (t[*row], mode.as_str()))));
        }
        if !self.ignored.is_empty() {
            let columns = self.ignored.clone();
            notes.push(Note::IgnoredColumns { columns });
        }
        super::note_end(table.terminated, &table.lines, &mut notes);
        Platoon { id: None, t, lines: table.lines.clone(), cars, notes }
    }
}
