//! Long tables: one row per vehicle and time. The table names the vehicle ahead, or lane and position give it.

mod ahead;
mod tracks;

use super::map::ColumnMap;
use super::plausible::{self, Pair};
use super::role::Role;
use super::rows::Table;
use super::text::{Direction, PositionAt};
use super::vehicle_name;
use crate::trajectory::error::ProblemKind;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::prepare::SEGMENT_MIN_S;
use crate::trajectory::{Car, Note, Platoon};
use std::collections::HashMap;
use tracks::{ABSENCE_MAX_S, Vehicle};

/// A stretch in which one vehicle follows another one: rows of both, of equal times.
struct Stretch {
    ego: usize,
    lead: usize,
    rows: Vec<(usize, usize)>,
}

/// The pairs of the table, the longest first.
pub(super) fn platoons(table: &Table, map: &ColumnMap, problems: &mut Problems) -> Result<Vec<Platoon>, Stop> {
    let mut long = Long::new(table, map, problems)?;
    let mut stretches: Vec<Stretch> = Vec::new();
    for ego in 0..long.vehicles.len() {
        long.follow(ego, &mut stretches);
    }
    let time = long.time;
    let duration = |s: &Stretch| match (s.rows.first(), s.rows.last()) {
        (Some(first), Some(last)) => time[last.0] - time[first.0],
        _ => 0.0,
    };
    let broken = |s: &Stretch| !long.vehicles[s.ego].faults.is_empty() || !long.vehicles[s.lead].faults.is_empty();
    stretches.retain(|stretch| !broken(stretch));
    let all = stretches.len();
    let longest = stretches.iter().map(duration).fold(0.0, f64::max);
    stretches.retain(|s| duration(s) >= SEGMENT_MIN_S);
    if stretches.is_empty() {
        long.refuse(problems)?;
        let (vehicles, needed) = (long.vehicles.len(), SEGMENT_MIN_S);
        let line = table.header_line.max(1);
        if map.is_searched() {
            return Err(problems.stop(line, None, ProblemKind::NobodyAhead { vehicles, longest, needed }));
        }
        let kind = ProblemKind::NoPairs { column: table.called(Role::Ahead), vehicles, longest, needed };
        return Err(problems.stop(line, None, kind));
    }
    if map.check_units {
        let pairs: Vec<Pair> = stretches.iter().map(|s| long.pair(s)).collect();
        let unusual = plausible::vehicles(table, map, &long.tracks(), problems);
        plausible::pairs(table, &pairs, problems);
        problems.check()?;
        long.notes.extend(unusual);
    }
    let short = all - stretches.len();
    // Stable, so pairs of equal length stay in the order of the file.
    stretches.sort_by(|a, b| duration(b).total_cmp(&duration(a)));
    let mut seen: HashMap<[(u32, u32); 2], usize> = HashMap::new();
    let mut platoons: Vec<Platoon> = stretches
        .iter()
        .map(|stretch| {
            let keys = [stretch.ego, stretch.lead].map(|vehicle| long.vehicles[vehicle].key);
            let count = seen.entry(keys).or_insert(0);
            *count += 1;
            long.platoon(stretch, *count)
        })
        .collect();
    let first = &mut platoons[0];
    first.notes.extend(table.notes.iter().cloned());
    table.note_rest(&mut first.notes);
    first.notes.extend(long.notes.iter().cloned());
    if short > 0 {
        first.notes.push(Note::ShortPairs { pairs: short, needed_s: SEGMENT_MIN_S });
    }
    Ok(platoons)
}

struct Long<'a> {
    table: &'a Table,
    map: &'a ColumnMap,
    time: &'a [f64],
    speed: &'a [f64],
    /// The vehicle ahead and its row at the same time, by row.
    ahead: Vec<Option<(u32, u32)>>,
    vehicles: Vec<Vehicle>,
    notes: Vec<Note>,
}

impl<'a> Long<'a> {
    fn new(table: &'a Table, map: &'a ColumnMap, problems: &mut Problems) -> Result<Self, Stop> {
        let numbers = |role| table.numbers(role).expect("a map without it is refused");
        let (time, speed) = (numbers(Role::Time), numbers(Role::Speed));
        let mut notes = Vec::new();
        let vehicles = tracks::vehicles(table, map, problems, &mut notes)?;
        let mut long = Long { table, map, time, speed, ahead: Vec::new(), vehicles, notes };
        if map.is_searched() {
            long.ahead = long.nearest_in_front();
        } else {
            let (ahead, vehicles) = long.named_ahead();
            long.ahead = ahead;
            long.notes.extend((vehicles > 0).then_some(Note::LeadersAbsent { vehicles }));
        }
        Ok(long)
    }

    /// Refuses the table for faults of its vehicles, if any.
    fn refuse(&self, problems: &mut Problems) -> Result<(), Stop> {
        problems.adopt(self.vehicles.iter().map(|vehicle| vehicle.faults.clone()));
        problems.check()
    }

    /// Speed in the direction of driving \[m/s\].
    fn forwards(&self, vehicle: &Vehicle, row: usize) -> f64 {
        if self.map.direction == Direction::BySpeed { vehicle.sign * self.speed[row] } else { self.speed[row] }
    }

    /// Position of the front in the direction of driving \[m\].
    fn front(&self, vehicle: &Vehicle, row: usize) -> Option<f64> {
        self.front_of(vehicle, row, vehicle.length)
    }

    /// The same of a vehicle with a follower.
    fn lead_front(&self, lead: &Vehicle, row: usize) -> Option<f64> {
        self.front_of(lead, row, self.lead_length(lead))
    }

    /// Length of a vehicle with a follower \[m\].
    fn lead_length(&self, lead: &Vehicle) -> Option<f64> {
        self.map.lead_override.or(lead.length)
    }

    fn front_of(&self, vehicle: &Vehicle, row: usize, length: Option<f64>) -> Option<f64> {
        let x = vehicle.sign * self.table.numbers(Role::Position)?[row];
        let length = length.unwrap_or(0.0);
        Some(match self.map.position_at {
            PositionAt::Front => x,
            PositionAt::Centre => x + length / 2.0,
            PositionAt::Rear => x + length,
            PositionAt::LowEnd if vehicle.sign < 0.0 => x,
            PositionAt::LowEnd => x + length,
        })
    }

    /// Finds the stretches in which the vehicle `ego` follows another one.
    fn follow(&self, ego: usize, stretches: &mut Vec<Stretch>) {
        let mut open: Option<Stretch> = None;
        let mut before = 0;
        for &row in &self.vehicles[ego].rows {
            let ahead = self.ahead[row];
            let lane = self.table.names(Role::Lane);
            let goes_on = open.as_ref().is_some_and(|stretch: &Stretch| {
                ahead.is_some_and(|(lead, _)| lead as usize == stretch.lead)
                    && lane.is_none_or(|lane| lane[before] == lane[row])
                    && self.time[row] - self.time[before] <= ABSENCE_MAX_S
            });
            if !goes_on {
                stretches.extend(open.take().filter(|stretch| stretch.rows.len() > 1));
            }
            if let Some((lead, lead_row)) = ahead.filter(|(_, row)| *row != ahead::ABSENT) {
                let lead = lead as usize;
                let stretch = open.get_or_insert_with(|| Stretch { ego, lead, rows: Vec::new() });
                stretch.rows.push((row, lead_row as usize));
            }
            before = row;
        }
        stretches.extend(open.filter(|stretch| stretch.rows.len() > 1));
    }

    /// The gap of a stretch \[m\] and its source.
    fn gap(&self, stretch: &Stretch) -> (Vec<f64>, Option<String>) {
        let (ego, lead) = (&self.vehicles[stretch.ego], &self.vehicles[stretch.lead]);
        if let Some(gap) = self.table.numbers(Role::Gap) {
            return (stretch.rows.iter().map(|rows| gap[rows.0]).collect(), None);
        }
        let length = self.lead_length(lead).unwrap_or(f64::NAN);
        if let Some(headway) = self.table.numbers(Role::Headway) {
            let from = "headway minus the length of the vehicle ahead".to_owned();
            return (stretch.rows.iter().map(|rows| headway[rows.0] - length).collect(), Some(from));
        }
        let gap = stretch.rows.iter().map(|&(row, other)| self.between(ego, row, lead, other) - length);
        (gap.collect(), Some("positions and the length of the vehicle ahead".to_owned()))
    }

    /// From front to front \[m\]; NaN without a position.
    fn between(&self, ego: &Vehicle, row: usize, lead: &Vehicle, lead_row: usize) -> f64 {
        let fronts = self.lead_front(lead, lead_row).zip(self.front(ego, row));
        fronts.map_or(f64::NAN, |(lead, ego)| self.map.ahead_by(lead - ego))
    }

    /// Input of the check of units.
    fn pair(&self, stretch: &Stretch) -> Pair {
        let (ego, lead) = (&self.vehicles[stretch.ego], &self.vehicles[stretch.lead]);
        let headway = self.table.numbers(Role::Headway);
        let rows = &stretch.rows;
        Pair {
            car: 0,
            t: rows.iter().map(|rows| self.time[rows.0]).collect(),
            v: rows.iter().map(|&(row, _)| self.forwards(ego, row)).collect(),
            dv: rows.iter().map(|&(row, other)| self.forwards(lead, other) - self.forwards(ego, row)).collect(),
            gap: self.table.numbers(Role::Gap).map(|gap| rows.iter().map(|rows| gap[rows.0]).collect()),
            headway: headway.map(|headway| rows.iter().map(|rows| headway[rows.0]).collect()),
            fronts: self
                .table
                .numbers(Role::Position)
                .map(|_| rows.iter().map(|&(row, other)| self.between(ego, row, lead, other)).collect()),
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
        &self.table.dictionary[self.vehicles[vehicle].key.1 as usize]
    }

    /// A stretch as a platoon of two; `count` numbers those of the same two vehicles.
    fn platoon(&self, stretch: &Stretch, count: usize) -> Platoon {
        let (gap, from) = self.gap(stretch);
        let mut notes = Vec::new();
        if let Some(from) = from {
            notes.push(Note::Derived { signal: "gap".to_owned(), from });
        }
        let unusable = gap.iter().filter(|&&gap| gap <= 0.0).count();
        if unusable > 0 {
            notes.push(Note::NoGap { car: 2, signal: "gap".to_owned(), samples: unusable });
        }
        let gap = gap.into_iter().map(|gap| if gap > 0.0 { gap } else { f64::NAN }).collect();
        let [lead, ego] = [stretch.lead, stretch.ego].map(|vehicle| &self.vehicles[vehicle]);
        // On a closed track a position continues where a lap ends.
        let mut x: Vec<f64> = stretch.rows.iter().filter_map(|rows| self.front(ego, rows.0)).collect();
        if self.map.lap_length.is_some() {
            // The last one that is not missing.
            let mut last = f64::NAN;
            for x in x.iter_mut().filter(|x| x.is_finite()) {
                if last.is_finite() {
                    *x = last + self.map.unwrapped(*x - last);
                }
                last = *x;
            }
        }
        let has_x = x.len() == stretch.rows.len();
        let ahead = stretch.rows.iter().zip(&x).map(|(&(row, other), x)| match self.map.lap_length {
            Some(_) => x + self.between(ego, row, lead, other),
            None => self.lead_front(lead, other).unwrap_or(f64::NAN),
        });
        let x_l: Vec<f64> = ahead.collect();
        let car = |number: usize, vehicle: usize, rows: &mut dyn Iterator<Item = usize>, x: Vec<f64>| {
            let rows: Vec<usize> = rows.collect();
            let own = &self.vehicles[vehicle];
            let a = self.table.numbers(Role::Acceleration);
            let turned = if self.map.direction == Direction::BySpeed { own.sign } else { 1.0 };
            Car {
                length: own.length,
                v: rows.iter().map(|&row| self.forwards(own, row)).collect(),
                x: has_x.then_some(x),
                a: a.map(|a| rows.iter().map(|&row| turned * a[row]).collect()),
                ..Car::new(number, Some(&vehicle_name(self.id(vehicle))))
            }
        };
        let length = self.lead_length(lead);
        let lead = Car { length, ..car(1, stretch.lead, &mut stretch.rows.iter().map(|rows| rows.1), x_l) };
        let ego = car(2, stretch.ego, &mut stretch.rows.iter().map(|rows| rows.0), x);
        let group = self.vehicles[stretch.ego].key.0;
        let group = self.table.names(Role::Group).map(|_| format!("{}:", self.table.dictionary[group as usize]));
        let mut id = format!("{}{}-{}", group.unwrap_or_default(), self.id(stretch.ego), self.id(stretch.lead));
        if count > 1 {
            id += &format!(".{count}");
        }
        let own: Vec<usize> = stretch.rows.iter().map(|rows| rows.0).collect();
        notes.extend(self.table.drivers(&own, 0, 2));
        Platoon {
            id: Some(id),
            t: stretch.rows.iter().map(|rows| self.time[rows.0]).collect(),
            lines: stretch.rows.iter().map(|rows| self.table.lines[rows.0]).collect(),
            cars: vec![lead, Car { gap: Some(gap), ..ego }],
            notes,
        }
    }
}
