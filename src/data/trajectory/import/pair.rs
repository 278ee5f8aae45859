//! Our own layout: a follower and its preceding vehicle, SI units in the column names.

use super::columns::pairs::relative;
use super::header::{Header, OWN_NAMES};
use super::lines::Lines;
use super::problems::{Problems, Stop};
use super::table::{Meaning, WHOLE, Wanted, read_rows};
use crate::trajectory::{Car, Note, Platoon};
use std::io::Read;

pub(super) const COLUMNS: &[&str] = &[
    "time_s",
    "speed_mps",
    "spacing_m",
    "lead_speed_mps",
    "sin_grade",
    "lead_position_m",
    "lead2_speed_mps",
    "lead2_spacing_m",
    "accel_mps2",
    DRIVER,
];
/// Who drives the follower.
const DRIVER: &str = "driver";
const NEEDED: &[&str] = &["time_s", "speed_mps", "spacing_m", "lead_speed_mps"];

fn meaning(name: &str) -> Meaning {
    match name {
        "time_s" => Meaning::Time,
        "speed_mps" | "lead_speed_mps" | "lead2_speed_mps" => Meaning::Speed,
        "spacing_m" | "lead2_spacing_m" => Meaning::Spacing,
        "lead_position_m" => Meaning::Position,
        "sin_grade" => Meaning::SinGrade,
        _ => Meaning::Number,
    }
}

/// Reads the file whose first line is `first`.
pub(super) fn read<R: Read>(
    first: &str,
    lines: &mut Lines<R>,
    problems: &mut Problems,
    skipped: &mut Vec<Note>,
) -> Result<Vec<Platoon>, Stop> {
    let header = Header::parse(first, lines.number(), problems)?;
    header.require(NEEDED, COLUMNS, OWN_NAMES, problems);
    let ignored = header.unknown(NEEDED, COLUMNS, problems);
    problems.check()?;
    let is_number = |name: &&&str| **name != DRIVER;
    let present: Vec<(&str, usize)> =
        COLUMNS.iter().filter(is_number).filter_map(|&name| header.find(name).map(|column| (name, column))).collect();
    let numbers = present.iter().map(|&(n, c)| (c, meaning(n))).collect();
    let wanted = Wanted { numbers, texts: header.find(DRIVER).into_iter().collect(), group: None };
    let mut table = read_rows(lines, &header, &wanted, problems, skipped)?;
    let column = |name: &str| present.iter().position(|&(n, _)| n == name).map(|place| &table.numbers[place]);
    if let (Some(lead), Some(own)) = (column("lead_speed_mps"), column("speed_mps"))
        && let Some(kind) = relative("lead_speed_mps", lead, own)
    {
        return Err(problems.stop(table.lines[0], None, kind));
    }
    // One pair, so an unusable signal makes the file unusable.
    table.refuse(problems)?;
    let mut notes: Vec<Note> = table.repeated.clone().into_iter().collect();
    for (car, signal) in [(1, "lead2_spacing_m"), (2, "spacing_m")] {
        let place = present.iter().position(|&(name, _)| name == signal);
        notes.extend(place.and_then(|place| table.no_gap(WHOLE, place, car, signal)));
    }
    let mut take = |name: &str| {
        let place = present.iter().position(|&(n, _)| n == name)?;
        Some(std::mem::take(&mut table.numbers[place]))
    };
    let mut cars = Vec::new();
    let ahead = take("lead2_speed_mps");
    let gap_ahead = take("lead2_spacing_m");
    if let Some(v) = ahead {
        // Number 0, so that the preceding vehicle is car 1 and the follower is follower 1, as in every other layout.
        cars.push(Car { v, ..Car::new(0, Some("car two ahead")) });
    }
    cars.push(Car {
        v: take("lead_speed_mps").unwrap_or_default(),
        x: take("lead_position_m"),
        gap: gap_ahead,
        ..Car::new(1, Some("preceding vehicle"))
    });
    cars.push(Car {
        v: take("speed_mps").unwrap_or_default(),
        gap: take("spacing_m"),
        a: take("accel_mps2"),
        sin_grade: take("sin_grade"),
        ..Car::new(2, Some("follower"))
    });
    let t = take("time_s").unwrap_or_default();
    let drivers = table.texts.first().map_or(&[][..], Vec::as_slice);
    notes.extend(super::driver_modes(2, drivers.iter().map(|(row, word)| (t[*row], word.as_str()))));
    if !ignored.is_empty() {
        notes.push(Note::IgnoredColumns { columns: ignored });
    }
    super::note_end(table.terminated, &table.lines, &mut notes);
    Ok(vec![Platoon { id: None, t, lines: table.lines, cars, notes }])
}
