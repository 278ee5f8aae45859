//! Do the units of a map agree with each other? Feet read as metres, km/h as m/s, a wrong frame rate, and a
//! wrong direction show as a factor between signals with the same content.

use super::map::ColumnMap;
use super::role::Role;
use super::rows::Table;
use crate::trajectory::Note;
use crate::trajectory::error::ProblemKind;
use crate::trajectory::factor;
use crate::trajectory::import::median;
use crate::trajectory::import::problems::Problems;
use crate::trajectory::steps::{largest_move, longest_step};
use std::slice;

/// Largest factor between signals with the same content, from noise and smoothing.
const FACTOR: f64 = 1.25;
/// Less variation than this is not enough \[m\].
const VARIATION_M: f64 = 1.0;
/// Half of all vehicles are neither shorter nor longer than this \[m\]: from a motorcycle to a lorry with two trailers.
const LENGTHS: [f64; 2] = [1.5, 30.0];
/// Half of all vehicles are longer than this \[m\] among lorries only, or where feet are taken for metres.
const LORRIES: f64 = 12.0;
/// Half of all distances are longer than the follower drives in this time \[s\], even in a platoon of lorries. As metres, times are shorter ...
const TIGHT_S: f64 = 0.25;
/// ... at speeds from here on \[m/s\].
const FAST: f64 = 8.0;
/// A usual time step lies between these \[s\].
const STEPS: [f64; 2] = [0.001, 5.0];

/// One vehicle over time.
pub(super) struct Track {
    pub t: Vec<f64>,
    pub v: Vec<f64>,
    /// Empty if no position is mapped.
    pub x: Vec<f64>,
    pub length: Option<f64>,
}

/// A follower and the vehicle ahead over time.
pub(super) struct Pair {
    /// The follower in a table of platoons; 0 elsewhere.
    pub car: usize,
    pub t: Vec<f64>,
    /// Speed of the follower.
    pub v: Vec<f64>,
    /// Speed of the vehicle ahead minus that of the follower.
    pub dv: Vec<f64>,
    pub gap: Option<Vec<f64>>,
    pub headway: Option<Vec<f64>>,
    /// Distance of the fronts by the positions.
    pub fronts: Option<Vec<f64>>,
}

impl Pair {
    fn distance(&self, role: Role) -> Option<&[f64]> {
        if role == Role::Gap { self.gap.as_deref() } else { self.headway.as_deref() }
    }
}

/// Checks the signals of each vehicle; values that are unusual but possible become a note.
pub(super) fn vehicles(table: &Table, map: &ColumnMap, tracks: &[Track], problems: &mut Problems) -> Option<Note> {
    let line = table.header_line.max(1);
    let (mut driven, mut moved) = (0.0, 0.0);
    for track in tracks.iter().filter(|track| track.x.len() == track.t.len()) {
        let (longest, most) = (longest_step(&track.t), largest_move(&track.x));
        for i in 1..track.t.len() {
            let dt = track.t[i] - track.t[i - 1];
            let step = map.unwrapped(track.x[i] - track.x[i - 1]);
            if dt > longest || step.abs() > most {
                continue;
            }
            let (by_speed, by_position) = ((track.v[i - 1] + track.v[i]) / 2.0 * dt, step);
            if by_speed.is_finite() && by_position.is_finite() {
                driven += by_speed;
                moved += by_position;
            }
        }
    }
    let ratio = moved / driven;
    if driven > VARIATION_M && !(1.0 / FACTOR..=FACTOR).contains(&ratio) {
        let (a, b) = (table.called(Role::Position), table.called(Role::Speed));
        let hint = if ratio < 0.0 {
            "the vehicles drive towards lower positions: set direction in the column map".to_owned()
        } else {
            hint(ratio, "check both units, and the unit of time or frame_rate_hz, in the column map")
        };
        problems.add(line, None, ProblemKind::UnitsContradict { a, b, ratio, hint });
    }
    let lengths = median(tracks.iter().filter_map(|track| track.length));
    // A table has feet or metres; where a map says that it has both, long vehicles are no lorries.
    let unit = |role| map.column(role).map(|column| &column.unit);
    let distances = [Role::Position, Role::Gap, Role::Headway].into_iter().filter_map(unit);
    let mixed = unit(Role::Length).is_some_and(|own| distances.into_iter().any(|other| other != own));
    let [lowest, highest] = [LENGTHS[0], if mixed { LORRIES } else { LENGTHS[1] }];
    if let Some(found) = lengths.filter(|length| !(lowest..=highest).contains(length)) {
        let column = table.called(Role::Length);
        problems.add(line, None, ProblemKind::MappedLength { column, lowest, highest, found });
    }
    let lorries = lengths.filter(|&length| length > LORRIES);
    lorries.map(|median_m| Note::LongVehicles { column: table.called(Role::Length), median_m })
}

/// Checks the signals of the pairs against each other.
pub(super) fn pairs(table: &Table, pairs: &[Pair], problems: &mut Problems) {
    let line = table.header_line.max(1);
    let steps = pairs.iter().flat_map(|pair| pair.t.windows(2).map(|t| t[1] - t[0]));
    if let Some(found) = median(steps).filter(|step| !(STEPS[0]..=STEPS[1]).contains(step)) {
        let column = table.called(Role::Time);
        problems.add(line, None, ProblemKind::MappedStep { column, shortest: STEPS[0], longest: STEPS[1], found });
        return;
    }
    if let Some(ratio) = against_positions(pairs) {
        let car = first(table, Role::Headway, pairs, |pair| against_positions(slice::from_ref(pair)).is_some());
        let [a, b] = [Role::Headway, Role::Position].map(|role| table.called_of(role, car));
        let hint = hint(ratio, "check both units, and direction, in the column map");
        problems.add(line, None, ProblemKind::UnitsContradict { a, b, ratio, hint });
    }
    for role in [Role::Gap, Role::Headway] {
        if let Some(found) = tight(pairs, role) {
            let car = first(table, role, pairs, |pair| tight(slice::from_ref(pair), role).is_some());
            problems.add(line, None, ProblemKind::MappedTimeHeadway { column: table.called_of(role, car), found });
            continue;
        }
        let Some(ratio) = against_speeds(pairs, role) else { continue };
        let car = first(table, role, pairs, |pair| against_speeds(slice::from_ref(pair), role).is_some());
        let speed = if table.numbers(Role::RelativeSpeed).is_some() { Role::RelativeSpeed } else { Role::Speed };
        let [a, b] = [role, speed].map(|role| table.called_of(role, car));
        let hint = if speed == Role::RelativeSpeed && ratio < 0.0 {
            "the relative speed is that of the follower minus that of the vehicle ahead: set its unit to \"-m/s\" in the column map".to_owned()
        } else {
            hint(ratio, "check both units in the column map")
        };
        problems.add(line, None, ProblemKind::UnitsContradict { a, b, ratio, hint });
    }
}

/// The car of the first pair that alone shows the fault of all; otherwise of the first pair with such a column.
fn first(table: &Table, role: Role, pairs: &[Pair], shows: impl Fn(&Pair) -> bool) -> usize {
    let has = |pair: &&Pair| !table.called_of(role, pair.car).is_empty();
    pairs.iter().find(|pair| shows(pair)).or_else(|| pairs.iter().find(has)).map_or(0, |pair| pair.car)
}

/// Factor between headway and distance of the fronts, if it is not about 1.
fn against_positions(pairs: &[Pair]) -> Option<f64> {
    let ratios = pairs.iter().filter_map(|pair| Some((pair.headway.as_ref()?, pair.fronts.as_ref()?)));
    let ratios =
        ratios.flat_map(|(headway, fronts)| headway.iter().zip(fronts).map(|(headway, front)| headway / front));
    median(ratios).filter(|ratio| !(1.0 / FACTOR..=FACTOR).contains(ratio))
}

/// Half of the distances at high speeds, if they are as short as times in place of distances \[m\].
fn tight(pairs: &[Pair], role: Role) -> Option<f64> {
    let of = |pair: &Pair| -> Vec<(f64, f64)> {
        let distance = pair.distance(role).unwrap_or_default();
        let whole = |(d, v): &(f64, f64)| *d > 0.0 && *v > FAST;
        distance.iter().copied().zip(pair.v.iter().copied()).filter(whole).collect()
    };
    let fast: Vec<(f64, f64)> = pairs.iter().flat_map(of).collect();
    median(fast.iter().map(|(d, v)| d / v)).filter(|time| *time < TIGHT_S)?;
    median(fast.iter().map(|(d, _)| *d))
}

/// Ratio of the change of the distance to that by the speeds, if it is certain and not about 1.
fn against_speeds(pairs: &[Pair], role: Role) -> Option<f64> {
    let drives = pairs.iter().filter_map(|pair| Some((pair.t.as_slice(), pair.dv.as_slice(), pair.distance(role)?)));
    factor::of_gap(drives)
}

fn hint(ratio: f64, otherwise: &str) -> String {
    factor::explain(ratio).map_or_else(|| otherwise.to_owned(), |words| format!("{words}: {otherwise}"))
}
