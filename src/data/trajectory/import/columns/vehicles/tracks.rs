//! Assigns rows to vehicles: a number that is absent for long, or elsewhere after a pause, is another vehicle.

use super::super::map::ColumnMap;
use super::super::role::Role;
use super::super::rows::{Repeated, Table};
use super::super::text::Direction;
use crate::trajectory::Note;
use crate::trajectory::error::{Faults, Problem, ProblemKind};
use crate::trajectory::import::median;
use crate::trajectory::import::number::REVERSE_LIMIT;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::steps::longest_step;
use std::collections::HashMap;

/// A vehicle that is absent for longer than this starts a new pair \[s\]: the pause is never interpolated.
pub(super) const ABSENCE_MAX_S: f64 = 60.0;
/// A vehicle that is further back than this after a pause is another one \[m\]: the distance exceeds errors of sensors.
const BACK_M: f64 = 10.0;

/// One vehicle: its rows in the order of time.
pub(super) struct Vehicle {
    /// Group and id.
    pub key: (u32, u32),
    pub rows: Vec<usize>,
    /// +1 towards higher positions.
    pub sign: f64,
    /// \[m\]
    pub length: Option<f64>,
    /// Faults of its values: its pairs are left out.
    pub faults: Faults,
}

/// The vehicles of a table, in the order in which it names them.
pub(super) fn vehicles(
    table: &Table,
    map: &ColumnMap,
    problems: &mut Problems,
    notes: &mut Vec<Note>,
) -> Result<Vec<Vehicle>, Stop> {
    let time = table.numbers(Role::Time).expect("a map without it is refused");
    let mut groups: Vec<((u32, u32), Vec<usize>)> = Vec::new();
    let mut place: HashMap<(u32, u32), usize> = HashMap::new();
    for row in 0..table.lines.len() {
        let key = table.key(row);
        let at = *place.entry(key).or_insert_with(|| {
            groups.push((key, Vec::new()));
            groups.len() - 1
        });
        groups[at].1.push(row);
    }
    let mut repeated = Repeated::default();
    for (key, rows) in &mut groups {
        rows.sort_by(|a, b| time[*a].total_cmp(&time[*b]));
        table.take_once(rows, &mut repeated, |first, line, found| {
            let id = table.dictionary[key.1 as usize].clone();
            problems.add(line, None, ProblemKind::VehicleTwice { id, found, first });
        });
    }
    problems.check()?;
    notes.extend(repeated.note());
    let numbers = groups.len();
    let mut vehicles = Vec::new();
    for (key, rows) in groups {
        vehicles.extend(split(rows, table, map).into_iter().map(|rows| vehicle(key, rows, table, map)));
    }
    if vehicles.len() > numbers {
        notes.push(Note::NumbersAgain { vehicles: vehicles.len() - numbers, numbers });
    }
    let broken: Vec<&Vehicle> = vehicles.iter().filter(|vehicle| !vehicle.faults.is_empty()).collect();
    // If most vehicles of a table are broken, the map does not fit it.
    if 2 * broken.len() > vehicles.len() {
        problems.adopt(broken.iter().map(|vehicle| vehicle.faults.clone()));
        problems.check()?;
    }
    if let Some(first) = broken.iter().filter_map(|vehicle| vehicle.faults.first.first()).min_by_key(|p| p.line) {
        let problem = format!("line {}: {}", first.line, first.kind);
        notes.push(Note::BrokenLeftOut { vehicles: broken.len(), problem });
    }
    Ok(vehicles)
}

/// The rows of one number, cut where another vehicle has it.
fn split(rows: Vec<usize>, table: &Table, map: &ColumnMap) -> Vec<Vec<usize>> {
    let time = table.numbers(Role::Time).expect("a map without it is refused");
    let t: Vec<f64> = rows.iter().map(|&row| time[row]).collect();
    let longest = longest_step(&t);
    let sign = direction(&rows, table, map);
    let back = |before: usize, after: usize| {
        let x = table.numbers(Role::Position).map(|x| sign * (x[after] - x[before]));
        // Without a direction of travel, "back" is undefined; on a ring it is also ahead.
        map.lap_length.is_none() && map.direction != Direction::ByPosition && x.is_some_and(|moved| moved < -BACK_M)
    };
    let mut pieces: Vec<Vec<usize>> = Vec::new();
    for row in rows {
        let anew = pieces.last().and_then(|piece| piece.last()).is_none_or(|&before| {
            let pause = time[row] - time[before];
            pause > ABSENCE_MAX_S || (pause > longest && back(before, row))
        });
        if anew {
            pieces.push(Vec::new());
        }
        pieces.last_mut().expect("it was just put there").push(row);
    }
    pieces
}

fn vehicle(key: (u32, u32), rows: Vec<usize>, table: &Table, map: &ColumnMap) -> Vehicle {
    let speed = table.numbers(Role::Speed).expect("a map without it is refused");
    let sign = direction(&rows, table, map);
    let forwards = |row: usize| if map.direction == Direction::BySpeed { sign * speed[row] } else { speed[row] };
    let mut faults = table.faults(&rows);
    for &row in &rows {
        let found = forwards(row);
        if found < REVERSE_LIMIT {
            let kind = ProblemKind::MappedReverse { column: table.called(Role::Speed), limit: REVERSE_LIMIT, found };
            faults.add(Problem { line: table.lines[row], column: None, kind });
        }
    }
    let length = table.numbers(Role::Length);
    let length = length.and_then(|length| median(rows.iter().map(|&row| length[row]))).filter(|&l| l > 0.0);
    Vehicle { key, rows, sign, length: length.or(map.length), faults }
}

/// +1 for a vehicle that drives towards higher positions.
fn direction(rows: &[usize], table: &Table, map: &ColumnMap) -> f64 {
    let speed = table.numbers(Role::Speed).expect("a map without it is refused");
    let position = table.numbers(Role::Position);
    match map.direction {
        Direction::Increasing => 1.0,
        Direction::Decreasing => -1.0,
        Direction::BySpeed => sign(rows.iter().map(|&row| speed[row]).filter(|v| v.is_finite()).sum()),
        Direction::ByPosition => position.map_or(1.0, |x| sign(way(rows.iter().map(|&row| x[row])))),
    }
}

/// From the first position to the last one, missing ones left out \[m\]; 0 with fewer than two.
fn way(positions: impl DoubleEndedIterator<Item = f64>) -> f64 {
    let mut measured = positions.filter(|x| x.is_finite());
    let first = measured.next();
    first.zip(measured.next_back()).map_or(0.0, |(first, last)| last - first)
}

fn sign(x: f64) -> f64 {
    if x < 0.0 { -1.0 } else { 1.0 }
}
