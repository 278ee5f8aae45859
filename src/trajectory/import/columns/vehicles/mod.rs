//! Long tables: one row per vehicle and time, which names the vehicle ahead.

use super::map::{ColumnMap, Direction, PositionAt};
use super::plausible::{self, Pair};
use super::role::Role;
use super::rows::Table;
use super::vehicle_name;
use crate::trajectory::error::ProblemKind;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::import::{median, note_end};
use crate::trajectory::prepare::SEGMENT_MIN_S;
use crate::trajectory::{Car, Note, Platoon};
use std::collections::HashMap;

/// A vehicle that is not seen for longer than this begins a new pair \[s\]: what lies between is never interpolated.
const ABSENCE_MAX_S: f64 = 60.0;
/// Backwards faster than this is no sensor noise at standstill \[m/s\].
const REVERSE_LIMIT: f64 = -0.5;

/// One vehicle: its rows in the order of time.
struct Vehicle {
    rows: Vec<usize>,
    /// +1 towards higher positions.
    sign: f64,
    /// \[m\]
    length: Option<f64>,
}

/// A stretch in which one vehicle follows another one: rows of both, of equal times.
struct Stretch {
    ego: usize,
    lead: usize,
    rows: Vec<(usize, usize)>,
}

/// The pairs of the table, the longest first.
pub(super) fn platoons(table: &Table, map: &ColumnMap, problems: &mut Problems) -> Result<Vec<Platoon>, Stop> {
    let long = Long::new(table, map, problems)?;
    let mut stretches: Vec<Stretch> = Vec::new();
    for ego in 0..long.vehicles.len() {
        long.follow(ego, &mut stretches);
    }
    let time = long.time;
    let duration = |s: &Stretch| match (s.rows.first(), s.rows.last()) {
        (Some(first), Some(last)) => time[last.0] - time[first.0],
        _ => 0.0,
    };
    let all = stretches.len();
    let longest = stretches.iter().map(duration).fold(0.0, f64::max);
    stretches.retain(|s| duration(s) >= SEGMENT_MIN_S);
    if stretches.is_empty() {
        let (vehicles, needed) = (long.vehicles.len(), SEGMENT_MIN_S);
        let kind = ProblemKind::NoPairs { column: table.called(Role::Ahead), vehicles, longest, needed };
        return Err(problems.stop(table.header_line.max(1), None, kind));
    }
    if map.check_units {
        let pairs: Vec<Pair> = stretches.iter().map(|s| long.pair(s)).collect();
        plausible::vehicles(table, &long.tracks(), problems);
        plausible::pairs(table, &pairs, problems);
        problems.check()?;
    }
    let short = all - stretches.len();
    // Stable, so pairs of equal length stay in the order of the file.
    stretches.sort_by(|a, b| duration(b).total_cmp(&duration(a)));
    let mut seen: HashMap<(usize, usize), usize> = HashMap::new();
    let mut platoons: Vec<Platoon> = stretches
        .iter()
        .map(|stretch| {
            let count = seen.entry((stretch.ego, stretch.lead)).or_insert(0);
            *count += 1;
            long.platoon(stretch, *count)
        })
        .collect();
    let first = &mut platoons[0];
    if !table.ignored.is_empty() {
        first.notes.push(Note::IgnoredColumns { columns: table.ignored.clone() });
    }
    if short > 0 {
        first.notes.push(Note::ShortPairs { pairs: short, needed_s: SEGMENT_MIN_S });
    }
    note_end(table.terminated, &table.lines, &mut first.notes);
    Ok(platoons)
}

struct Long<'a> {
    table: &'a Table,
    map: &'a ColumnMap,
    time: &'a [f64],
    speed: &'a [f64],
    ahead: &'a [u32],
    vehicles: Vec<Vehicle>,
    /// Group and id of each vehicle.
    keys: Vec<(u32, u32)>,
    place: HashMap<(u32, u32), usize>,
}

impl<'a> Long<'a> {
    fn new(table: &'a Table, map: &'a ColumnMap, problems: &mut Problems) -> Result<Self, Stop> {
        let numbers = |role| table.numbers(role).expect("a map without it is refused");
        let names = |role| table.names(role).expect("a map without it is refused");
        let (time, id, group) = (numbers(Role::Time), names(Role::Id), table.names(Role::Group));
        let mut rows: Vec<Vec<usize>> = Vec::new();
        let mut keys = Vec::new();
        let mut place: HashMap<(u32, u32), usize> = HashMap::new();
        for row in 0..table.lines.len() {
            let key = (group.map_or(0, |group| group[row]), id[row]);
            let vehicle = *place.entry(key).or_insert_with(|| {
                keys.push(key);
                rows.push(Vec::new());
                rows.len() - 1
            });
            rows[vehicle].push(row);
        }
        for (vehicle, rows) in rows.iter_mut().enumerate() {
            rows.sort_by(|a, b| time[*a].total_cmp(&time[*b]));
            for pair in rows.windows(2).filter(|pair| time[pair[0]] == time[pair[1]]) {
                let id = table.dictionary[keys[vehicle].1 as usize].clone();
                let (first, found) = (table.lines[pair[0]], time[pair[1]]);
                problems.add(table.lines[pair[1]], None, ProblemKind::VehicleTwice { id, found, first });
            }
        }
        problems.check()?;
        let speed = numbers(Role::Speed);
        let position = table.numbers(Role::Position);
        let length = table.numbers(Role::Length);
        let vehicles: Vec<Vehicle> = rows
            .into_iter()
            .map(|rows| Vehicle {
                sign: match map.direction {
                    Direction::Increasing => 1.0,
                    Direction::Decreasing => -1.0,
                    Direction::BySpeed => sign(rows.iter().map(|&row| speed[row]).filter(|v| v.is_finite()).sum()),
                    Direction::ByPosition => position.map_or(1.0, |x| sign(way(rows.iter().map(|&row| x[row])))),
                },
                length: length.and_then(|length| median(rows.iter().map(|&row| length[row]))).filter(|&l| l > 0.0),
                rows,
            })
            .collect();
        let long = Long { table, map, time, speed, ahead: names(Role::Ahead), vehicles, keys, place };
        for vehicle in &long.vehicles {
            for &row in &vehicle.rows {
                let found = long.forwards(vehicle, row);
                if found < REVERSE_LIMIT {
                    let column = table.called(Role::Speed);
                    let kind = ProblemKind::MappedReverse { column, limit: REVERSE_LIMIT, found };
                    problems.add(table.lines[row], None, kind);
                }
            }
        }
        problems.check()?;
        Ok(long)
    }

    /// Speed in the direction of driving \[m/s\].
    fn forwards(&self, vehicle: &Vehicle, row: usize) -> f64 {
        if self.map.direction == Direction::BySpeed { vehicle.sign * self.speed[row] } else { self.speed[row] }
    }

    /// Position of the front in the direction of driving \[m\].
    fn front(&self, vehicle: &Vehicle, row: usize) -> Option<f64> {
        let x = vehicle.sign * self.table.numbers(Role::Position)?[row];
        let length = vehicle.length.unwrap_or(0.0);
        Some(match self.map.position_at {
            PositionAt::Front => x,
            PositionAt::Centre => x + length / 2.0,
            PositionAt::Rear => x + length,
            PositionAt::LowEnd if vehicle.sign < 0.0 => x,
            PositionAt::LowEnd => x + length,
        })
    }

    /// Finds the stretches in which the vehicle `ego` follows somebody.
    fn follow(&self, ego: usize, stretches: &mut Vec<Stretch>) {
        let mut open: Option<Stretch> = None;
        let mut before = 0;
        for &row in &self.vehicles[ego].rows {
            let ahead = &self.table.dictionary[self.ahead[row] as usize];
            let nobody = self.map.nobody.contains(ahead);
            let key = (self.keys[ego].0, self.ahead[row]);
            let lead = self.place.get(&key).copied().filter(|&lead| !nobody && lead != ego);
            let lead_row = lead.and_then(|lead| {
                let rows = &self.vehicles[lead].rows;
                let found = rows.binary_search_by(|&other| self.time[other].total_cmp(&self.time[row]));
                found.ok().map(|at| rows[at])
            });
            let lane = self.table.names(Role::Lane);
            let goes_on = open.as_ref().is_some_and(|stretch: &Stretch| {
                Some(stretch.lead) == lead
                    && lane.is_none_or(|lane| lane[before] == lane[row])
                    && self.time[row] - self.time[before] <= ABSENCE_MAX_S
            });
            if !goes_on {
                stretches.extend(open.take().filter(|stretch| stretch.rows.len() > 1));
            }
            if let (Some(lead), Some(lead_row)) = (lead, lead_row) {
                open.get_or_insert_with(|| Stretch { ego, lead, rows: Vec::new() }).rows.push((row, lead_row));
            }
            before = row;
        }
        stretches.extend(open.filter(|stretch| stretch.rows.len() > 1));
    }

    /// The gap of a stretch \[m\] and what it was derived from.
    fn gap(&self, stretch: &Stretch) -> (Vec<f64>, Option<String>) {
        let (ego, lead) = (&self.vehicles[stretch.ego], &self.vehicles[stretch.lead]);
        if let Some(gap) = self.table.numbers(Role::Gap) {
            return (stretch.rows.iter().map(|rows| gap[rows.0]).collect(), None);
        }
        let length = lead.length.unwrap_or(f64::NAN);
        if let Some(headway) = self.table.numbers(Role::Headway) {
            let from = "headway minus the length of the vehicle ahead".to_owned();
            return (stretch.rows.iter().map(|rows| headway[rows.0] - length).collect(), Some(from));
        }
        let front = |vehicle, row| self.front(vehicle, row).unwrap_or(f64::NAN);
        let gap = stretch.rows.iter().map(|&(row, lead_row)| front(lead, lead_row) - length - front(ego, row));
        (gap.collect(), Some("positions and the length of the vehicle ahead".to_owned()))
    }

    /// What the check of units looks at.
    fn pair(&self, stretch: &Stretch) -> Pair {
        let (ego, lead) = (&self.vehicles[stretch.ego], &self.vehicles[stretch.lead]);
        let headway = self.table.numbers(Role::Headway);
        let rows = &stretch.rows;
        Pair {
            t: rows.iter().map(|rows| self.time[rows.0]).collect(),
            dv: rows.iter().map(|&(row, other)| self.forwards(lead, other) - self.forwards(ego, row)).collect(),
            gap: self.table.numbers(Role::Gap).map(|gap| rows.iter().map(|rows| gap[rows.0]).collect()),
            headway: headway.map(|headway| rows.iter().map(|rows| headway[rows.0]).collect()),
            fronts: self.table.numbers(Role::Position).map(|_| {
                let front = |vehicle, row| self.front(vehicle, row).unwrap_or(f64::NAN);
                rows.iter().map(|&(row, other)| front(lead, other) - front(ego, row)).collect()
            }),
        }
    }

    /// Times, speeds and positions of every vehicle, and its length.
    fn tracks(&self) -> Vec<plausible::Track> {
        let track = |vehicle: &Vehicle| plausible::Track {
            t: vehicle.rows.iter().map(|&row| self.time[row]).collect(),
            v: vehicle.rows.iter().map(|&row| self.forwards(vehicle, row)).collect(),
            x: vehicle.rows.iter().filter_map(|&row| self.front(vehicle, row)).collect(),
            length: vehicle.length,
        };
        self.vehicles.iter().map(track).collect()
    }

    fn id(&self, vehicle: usize) -> &str {
        &self.table.dictionary[self.keys[vehicle].1 as usize]
    }

    /// A stretch as a platoon of two; `count` says which of several of the same two vehicles.
    fn platoon(&self, stretch: &Stretch, count: usize) -> Platoon {
        let (gap, from) = self.gap(stretch);
        let mut notes = Vec::new();
        if let Some(from) = from {
            notes.push(Note::Derived { signal: "gap".to_owned(), from });
        }
        let unusable = gap.iter().filter(|&&gap| gap <= 0.0).count();
        if unusable > 0 {
            notes.push(Note::NoGap { samples: unusable });
        }
        let gap = gap.into_iter().map(|gap| if gap > 0.0 { gap } else { f64::NAN }).collect();
        let car = |number: usize, vehicle: usize, rows: &mut dyn Iterator<Item = usize>| {
            let rows: Vec<usize> = rows.collect();
            let own = &self.vehicles[vehicle];
            let a = self.table.numbers(Role::Acceleration);
            let turned = if self.map.direction == Direction::BySpeed { own.sign } else { 1.0 };
            Car {
                length: own.length,
                v: rows.iter().map(|&row| self.forwards(own, row)).collect(),
                x: rows.iter().map(|&row| self.front(own, row)).collect(),
                a: a.map(|a| rows.iter().map(|&row| turned * a[row]).collect()),
                ..Car::new(number, Some(&vehicle_name(self.id(vehicle))))
            }
        };
        let lead = car(1, stretch.lead, &mut stretch.rows.iter().map(|rows| rows.1));
        let ego = car(2, stretch.ego, &mut stretch.rows.iter().map(|rows| rows.0));
        let group = self.keys[stretch.ego].0;
        let group = self.table.names(Role::Group).map(|_| format!("{}:", self.table.dictionary[group as usize]));
        let mut id = format!("{}{}-{}", group.unwrap_or_default(), self.id(stretch.ego), self.id(stretch.lead));
        if count > 1 {
            id += &format!(".{count}");
        }
        Platoon {
            id: Some(id),
            t: stretch.rows.iter().map(|rows| self.time[rows.0]).collect(),
            lines: stretch.rows.iter().map(|rows| self.table.lines[rows.0]).collect(),
            cars: vec![lead, Car { gap: Some(gap), ..ego }],
            notes,
        }
    }
}

/// From the first position to the last one, missing ones left out \[m\]; 0 where there are no two.
fn way(positions: impl DoubleEndedIterator<Item = f64>) -> f64 {
    let mut measured = positions.filter(|x| x.is_finite());
    let first = measured.next();
    first.zip(measured.next_back()).map_or(0.0, |(first, last)| last - first)
}

fn sign(x: f64) -> f64 {
    if x < 0.0 { -1.0 } else { 1.0 }
}
