//! Wide tables: one row per time of a follower and the vehicle ahead of it.

use super::map::ColumnMap;
use super::plausible::{self, Pair};
use super::role::Role;
use super::rows::Table;
use crate::trajectory::error::{Faults, Problem, ProblemKind};
use crate::trajectory::import::number::REVERSE_LIMIT;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::{Car, Note, Platoon};
use std::collections::{HashMap, HashSet};

/// The rows of one group, or of one of several trajectories that have its name.
pub(super) struct Group {
    /// The name in the file; `None` if no column gives one.
    pub name: Option<String>,
    /// The same, numbered from the second on.
    pub id: Option<String>,
    pub rows: Vec<usize>,
    /// Note that an earlier one had the same name.
    pub again: Option<Note>,
}

/// The rows of each trajectory in the order of the file. Of those with the same name the later ones are numbered.
fn by_group(table: &Table) -> Vec<Group> {
    let names = table.names(Role::Group);
    let mut groups: Vec<(Option<u32>, Vec<usize>)> = Vec::new();
    let mut place = HashMap::new();
    for row in 0..table.lines.len() {
        let at = *place.entry(table.pieces[row]).or_insert_with(|| {
            groups.push((names.map(|names| names[row]), Vec::new()));
            groups.len() - 1
        });
        groups[at].1.push(row);
    }
    let name = |group: u32| table.dictionary[group as usize].as_str();
    let mut taken: HashSet<String> = groups.iter().filter_map(|(group, _)| Some(name((*group)?).to_owned())).collect();
    let mut seen = HashMap::new();
    let numbered = |(group, rows): (Option<u32>, Vec<usize>)| {
        let number = seen.entry(group).and_modify(|number| *number += 1).or_insert(1);
        let given = group.map(|group| name(group).to_owned());
        let id = given.clone().map(|name| match *number {
            1 => name,
            number => {
                let free = (number..).map(|number| format!("{name}.{number}")).find(|id| taken.insert(id.clone()));
                free.expect("one of endlessly many numbers is free")
            }
        });
        let again = given.clone().zip(id.clone()).filter(|_| *number > 1);
        let again = again.map(|(id, read_as)| Note::IdAgain { id, line: table.lines[rows[0]], read_as });
        Group { id, name: given, rows, again }
    };
    groups.into_iter().map(numbered).collect()
}

/// One platoon per group, in the order of the file, by `platoon`, which adds its pairs.
pub(super) fn of_groups(
    table: &Table,
    map: &ColumnMap,
    problems: &mut Problems,
    platoon: fn(&Table, &ColumnMap, Group, &mut Vec<Pair>) -> Platoon,
) -> Result<Vec<Platoon>, Stop> {
    let mut pairs = Vec::new();
    let groups = by_group(table).into_iter().filter(|group| group.rows.len() > 1);
    let mut platoons: Vec<Platoon> = groups
        .map(|mut group| {
            let again = group.again.take();
            let mut platoon = platoon(table, map, group, &mut pairs);
            platoon.notes.extend(again);
            platoon
        })
        .collect();
    if !platoons.iter().any(Platoon::is_usable) {
        let cars = platoons.iter().flat_map(|platoon| &platoon.cars);
        problems.adopt(cars.flat_map(|car| [car.faults.clone(), car.gap_faults.clone()]));
        problems.check()?;
    }
    let Some(first) = platoons.first_mut() else {
        return Err(problems.stop(table.lines[0], None, ProblemKind::OneRow));
    };
    if map.check_units {
        plausible::pairs(table, &pairs, problems);
        problems.check()?;
    }
    table.note(first);
    Ok(platoons)
}

/// No car drives fast behind a vehicle that is slower than this on average \[m/s\].
const SLOW: f64 = 2.0;
/// Faster than this is fast \[m/s\].
const FAST: f64 = 8.0;

/// That a speed of the vehicle ahead is the difference to that of the follower.
pub fn relative(column: &str, lead: &[f64], own: &[f64]) -> Option<ProblemKind> {
    let middle = |speed: &[f64]| crate::trajectory::import::median(speed.iter().copied());
    let (found, own) = (middle(lead)?, middle(own)?);
    let backwards = || lead.iter().any(|v| *v < 0.0);
    (found.abs() < SLOW && own > FAST && backwards()).then(|| ProblemKind::MappedRelative {
        column: column.to_owned(),
        own,
        found,
    })
}

/// Faults in the values of some rows: they are broken, or a vehicle drives backwards.
fn faults(table: &Table, rows: &[usize]) -> Faults {
    let mut faults = table.faults(rows);
    let of = |role| rows.iter().map(|&row| table.numbers(role).map(|v| v[row])).collect::<Option<Vec<f64>>>();
    let relative = || relative(&table.called(Role::LeadSpeed), &of(Role::LeadSpeed)?, &of(Role::Speed)?);
    if let Some(kind) = relative() {
        faults.add(Problem { line: table.lines[rows[0]], column: None, kind });
        return faults;
    }
    for role in [Role::Speed, Role::LeadSpeed, Role::Lead2Speed] {
        let speed = table.numbers(role).unwrap_or_default();
        for &row in rows.iter().filter(|&&row| speed.get(row).is_some_and(|v| *v < REVERSE_LIMIT)) {
            let kind =
                ProblemKind::MappedReverse { column: table.called(role), limit: REVERSE_LIMIT, found: speed[row] };
            faults.add(Problem { line: table.lines[row], column: None, kind });
        }
    }
    faults
}

/// A follower and the vehicle ahead.
pub(super) fn platoon(table: &Table, map: &ColumnMap, group: Group, pairs: &mut Vec<Pair>) -> Platoon {
    let Group { name, id, rows, .. } = &group;
    let follower = name.as_deref().unwrap_or("follower");
    let take = |role: Role| table.numbers(role).map(|all| rows.iter().map(|&row| all[row]).collect::<Vec<f64>>());
    let mut notes = Vec::new();
    let constant = |length: Option<f64>| Some(vec![length?; rows.len()]);
    let length = constant(map.lead_override).or_else(|| take(Role::LeadLength)).or_else(|| constant(map.lead_length));
    let (x, x_l) = (take(Role::Position), take(Role::LeadPosition));
    let minus_length = |of: &[f64]| -> Vec<f64> {
        let length = length.as_deref().unwrap_or_default();
        of.iter().zip(length).map(|(of, length)| of - length).collect()
    };
    let headway = take(Role::Headway);
    let measured = take(Role::Gap);
    let fronts: Option<Vec<f64>> =
        x.as_ref().zip(x_l.as_ref()).map(|(x, x_l)| x.iter().zip(x_l).map(|(x, x_l)| map.ahead_by(x_l - x)).collect());
    let mut derived = |from: &str| {
        notes.push(Note::Derived { signal: "gap".to_owned(), from: from.to_owned() });
    };
    let gap = match (&measured, &headway, &fronts) {
        (Some(gap), ..) => Some(gap.clone()),
        (None, Some(headway), _) if length.is_some() => {
            derived("headway minus the length of the vehicle ahead");
            Some(minus_length(headway))
        }
        (None, None, Some(fronts)) if length.is_some() => {
            derived("positions and the length of the vehicle ahead");
            Some(minus_length(fronts))
        }
        // Without a length preparation asks for one.
        _ => None,
    };
    let mut faults = faults(table, rows);
    let mut positive = |gap: Option<Vec<f64>>, role, car| {
        let name = if role == Role::Gap { "gap" } else { "gap of the vehicle ahead" };
        let gap = table.above_0(gap?, rows, (role, 0), car, name);
        notes.extend(gap.note);
        faults.merge(gap.faults);
        Some(gap.values)
    };
    let lead2_gap = positive(take(Role::Lead2Gap), Role::Lead2Gap, 1);
    let gap = positive(gap, Role::Gap, 2);
    let t = take(Role::Time).unwrap_or_default();
    let (v, v_l) = (take(Role::Speed).unwrap_or_default(), take(Role::LeadSpeed));
    let relative = || take(Role::RelativeSpeed).unwrap_or_default();
    let v_l = v_l.unwrap_or_else(|| v.iter().zip(relative()).map(|(v, relative)| v + relative).collect());
    pairs.push(Pair {
        car: 0,
        t: t.clone(),
        v: v.clone(),
        dv: v_l.iter().zip(&v).map(|(v_l, v)| v_l - v).collect(),
        gap: measured,
        headway,
        fronts,
    });
    let mut cars = Vec::new();
    if let Some(v) = take(Role::Lead2Speed) {
        cars.push(Car { v, ..Car::new(0, Some("car two ahead")) });
    }
    let len_l = length.as_ref().and_then(|length| crate::trajectory::import::median(length.iter().copied()));
    cars.push(Car {
        v: v_l,
        x: x_l,
        length: len_l,
        gap: lead2_gap,
        a: take(Role::LeadAcceleration),
        ..Car::new(1, Some("preceding vehicle"))
    });
    cars.push(Car {
        v,
        x,
        gap,
        a: take(Role::Acceleration),
        sin_grade: take(Role::SinGrade),
        faults,
        ..Car::new(2, Some(follower))
    });
    notes.extend(table.drivers(rows, 0, 2));
    let lines = rows.iter().map(|&row| table.lines[row]).collect();
    Platoon { id: id.clone(), t, lines, cars, notes }
}
