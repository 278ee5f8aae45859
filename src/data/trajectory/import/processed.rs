//! AstaZero platoons as processed by the paper's authors: positions, speeds and spacings agree already.

use super::header::{Header, OWN_NAMES};
use super::labels::Labels;
use super::lines::Lines;
use super::problems::{Problems, Stop};
use super::table::{Meaning, WHOLE, Wanted, read_rows};
use crate::trajectory::{Car, Faults, Note, Platoon};
use std::io::Read;

/// Largest number of cars in one platoon.
const CARS_MAX: usize = 100;

/// Reads the file whose first line is `first`.
pub(super) fn read<R: Read>(
    first: &str,
    lines: &mut Lines<R>,
    problems: &mut Problems,
    skipped: &mut Vec<Note>,
) -> Result<Vec<Platoon>, Stop> {
    let header = Header::parse(first, lines.number(), problems)?;
    let count = (1..=CARS_MAX)
        .take_while(|k| [format!("X{k}"), format!("SpeedDoppler{k}")].iter().any(|name| header.find(name).is_some()))
        .count()
        .max(2);
    let mut needed = vec!["Time".to_owned()];
    needed.extend((1..=count).map(|k| format!("X{k}")));
    needed.extend((1..=count).map(|k| format!("SpeedDoppler{k}")));
    needed.extend((2..=count).map(|k| format!("Spacing{k}")));
    let needed: Vec<&str> = needed.iter().map(String::as_str).collect();
    let accel: Vec<String> = (1..=count).map(|k| format!("Accel{k}")).collect();
    let mut known = needed.clone();
    known.extend(accel.iter().map(String::as_str));
    header.require(&needed, &known, OWN_NAMES, problems);
    let ignored = header.unknown(&needed, &known, problems);
    problems.check()?;

    let meaning = |name: &str| match name {
        "Time" => Meaning::Time,
        _ if name.starts_with("SpeedDoppler") => Meaning::Speed,
        _ if name.starts_with("Spacing") => Meaning::Spacing,
        _ if name.starts_with('X') => Meaning::Position,
        _ => Meaning::Number,
    };
    let present: Vec<(&str, usize)> =
        known.iter().filter_map(|&name| header.find(name).map(|column| (name, column))).collect();
    let wanted =
        Wanted { numbers: present.iter().map(|&(n, c)| (c, meaning(n))).collect(), texts: Vec::new(), group: None };
    let mut table = read_rows(lines, &header, &wanted, problems, skipped)?;
    let place = |name: &str| present.iter().position(|&(n, _)| n == name);
    let mut notes: Vec<Note> = table.repeated.clone().into_iter().collect();
    let mut faults = Vec::with_capacity(count);
    for number in 1..=count {
        let mut own = Faults::default();
        for name in [format!("SpeedDoppler{number}"), format!("X{number}"), format!("Accel{number}")] {
            own.merge(place(&name).map(|place| table.faults(WHOLE, place)).unwrap_or_default());
        }
        let signal = format!("Spacing{number}");
        let gap = place(&signal);
        notes.extend(gap.and_then(|gap| table.no_gap(WHOLE, gap, number, &signal)));
        faults.push((own, gap.map(|gap| table.faults(WHOLE, gap)).unwrap_or_default()));
    }
    let mut take = |name: String| Some(std::mem::take(&mut table.numbers[place(&name)?]));
    let t = take("Time".to_owned()).unwrap_or_default();
    let cars = (1..=count).zip(faults).map(|(number, (faults, gap_faults))| Car {
        v: take(format!("SpeedDoppler{number}")).unwrap_or_default(),
        x: take(format!("X{number}")),
        gap: take(format!("Spacing{number}")),
        a: take(format!("Accel{number}")),
        faults,
        gap_faults,
        ..Car::new(number, None)
    });
    let cars = cars.collect();
    if !ignored.is_empty() {
        notes.push(Note::IgnoredColumns { columns: ignored });
    }
    super::note_end(table.terminated, &table.lines, &mut notes);
    let platoon = Platoon { id: None, t, lines: table.lines.clone(), cars, notes };
    if !platoon.is_usable() {
        table.refuse(problems)?;
    }
    Ok(vec![platoon])
}

/// Names and lengths from the table beside the file; lengths it does not give follow from the positions.
pub(super) fn name_cars(platoon: &mut Platoon, file_stem: &str, labels: Option<&Labels>) {
    let found = labels.and_then(|labels| labels.get(file_stem));
    for car in &mut platoon.cars {
        if let Some(label) = found.and_then(|labels| labels.get(car.number - 1)) {
            car.name.clone_from(&label.name);
            car.length = Some(label.length);
        }
    }
    for follower in 1..platoon.cars.len() {
        let (front, back) = platoon.cars.split_at_mut(follower);
        let (Some(front), back) = (front.last_mut(), &back[0]) else {
            continue;
        };
        let (Some(x_l), Some(x_f), Some(gap)) = (&front.x, &back.x, &back.gap) else {
            continue;
        };
        if front.length.is_none() {
            let differences = (0..gap.len()).map(|i| x_l[i] - x_f[i] - gap[i]);
            if let Some(length) = super::median(differences) {
                front.length = Some(length);
                platoon.notes.push(Note::LengthDerived {
                    car: front.number,
                    length_m: length,
                    from: "positions and spacing".to_owned(),
                });
            }
        }
    }
}
