//! Wide tables: one row per time of a follower and the vehicle ahead of it.

use super::map::ColumnMap;
use super::plausible::{self, Pair};
use super::role::Role;
use super::rows::{Repeated, Table};
use crate::trajectory::error::{Faults, Problem, ProblemKind};
use crate::trajectory::import::note_end;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::import::table::REVERSE_LIMIT;
use crate::trajectory::prepare::SEGMENT_MIN_S;
use crate::trajectory::{Car, Note, Platoon};
use std::collections::HashMap;

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

/// The rows of each group in the order of the file, whose times must rise; repeated rows count once.
pub(super) fn by_group(table: &Table, problems: &mut Problems) -> Result<(Vec<Group>, Repeated), Stop> {
    let mut groups: Vec<(Option<u32>, Vec<usize>)> = Vec::new();
    let mut place = HashMap::new();
    for row in 0..table.lines.len() {
        let group = table.names(Role::Group).map(|group| group[row]);
        let at = *place.entry(group).or_insert_with(|| {
            groups.push((group, Vec::new()));
            groups.len() - 1
        });
        groups[at].1.push(row);
    }
    let mut repeated = Repeated::default();
    let mut found = Vec::new();
    for (group, rows) in groups {
        let mut pieces = pieces(rows, table);
        if group.is_none() && pieces.len() > 1 {
            if table.guess.is_empty() {
                let row = pieces[1][0];
                let found = table.numbers(Role::Time).map_or(f64::NAN, |time| time[row]);
                let kind = ProblemKind::TimeAnew { column: table.called(Role::Time), found };
                return Err(problems.stop(table.lines[row], None, kind));
            }
            pieces = vec![pieces.concat()];
        }
        for (number, mut rows) in (1..).zip(pieces) {
            check_times(&mut rows, table, &mut repeated, problems);
            let name = group.map(|group| table.dictionary[group as usize].clone());
            let numbered = name.as_ref().map(|name| format!("{name}.{number}")).filter(|_| number > 1);
            let again = numbered.clone().zip(name.clone()).map(|(read_as, id)| Note::IdAgain {
                id,
                line: table.lines[rows[0]],
                read_as,
            });
            found.push(Group { id: numbered.or_else(|| name.clone()), name, rows, again });
        }
    }
    problems.check()?;
    Ok((found, repeated))
}

/// The rows of a group, cut where its time restarts: another trajectory has the same name.
fn pieces(rows: Vec<usize>, table: &Table) -> Vec<Vec<usize>> {
    let time = table.numbers(Role::Time).expect("a map without it is refused");
    let mut pieces: Vec<Vec<usize>> = Vec::new();
    for row in rows {
        let anew = pieces.last().is_none_or(|piece| {
            let [first, last] = [piece[0], piece[piece.len() - 1]].map(|row| time[row]);
            time[row] <= first
                && last - first >= SEGMENT_MIN_S
                && !piece.iter().any(|&other| table.is_repeated(other, row))
        });
        if anew {
            pieces.push(Vec::new());
        }
        pieces.last_mut().expect("it was just put there").push(row);
    }
    pieces
}

/// Repeated rows are removed; the times of the others must rise.
fn check_times(rows: &mut Vec<usize>, table: &Table, repeated: &mut Repeated, problems: &mut Problems) {
    let time = table.numbers(Role::Time).expect("a map without it is refused");
    // One message in place of one per row.
    if let Some(pair) = rows.windows(2).find(|pair| time[pair[1]] <= time[pair[0]]).filter(|_| !table.guess.is_empty())
    {
        let (column, guess) = (table.called(Role::Time), table.guess.clone());
        let kind = ProblemKind::NoGroup { column, previous: time[pair[0]], found: time[pair[1]], guess };
        return problems.add(table.lines[pair[1]], None, kind);
    }
    table.take_once(rows, repeated, |first, line, found| {
        problems.add(line, None, ProblemKind::TimeTwice { column: table.called(Role::Time), found, first });
    });
    for pair in rows.windows(2).filter(|pair| time[pair[1]] < time[pair[0]]) {
        let (previous, found) = (time[pair[0]], time[pair[1]]);
        let kind = ProblemKind::TimeBack { column: table.called(Role::Time), previous, found };
        problems.add(table.lines[pair[1]], None, kind);
    }
}

/// One platoon per group, in the order of the file.
pub(super) fn platoons(table: &Table, map: &ColumnMap, problems: &mut Problems) -> Result<Vec<Platoon>, Stop> {
    let (groups, repeated) = by_group(table, problems)?;
    let mut platoons = Vec::new();
    let mut pairs = Vec::new();
    for Group { name, id, rows, again } in groups.into_iter().filter(|group| group.rows.len() > 1) {
        let follower = name.as_deref().unwrap_or("follower");
        let (mut platoon, pair) = platoon(table, map, id, follower, &rows);
        platoon.notes.extend(again);
        platoons.push(platoon);
        pairs.push(pair);
    }
    if !platoons.iter().any(Platoon::is_usable) {
        problems.adopt(platoons.iter().flat_map(|platoon| &platoon.cars).map(|car| car.faults.clone()));
        problems.check()?;
    }
    let Some(first) = platoons.first_mut() else {
        return Err(problems.stop(table.lines[0], None, ProblemKind::OneRow));
    };
    first.notes.extend(repeated.note());
    if map.check_units {
        plausible::pairs(table, &pairs, problems);
        problems.check()?;
    }
    first.notes.extend(table.notes.iter().cloned());
    note_end(table.terminated, &table.lines, &mut first.notes);
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

fn platoon(table: &Table, map: &ColumnMap, id: Option<String>, follower: &str, rows: &[usize]) -> (Platoon, Pair) {
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
    let unusable = gap.iter().flatten().filter(|&&gap| gap <= 0.0).count();
    if unusable > 0 {
        notes.push(Note::NoGap { car: 2, signal: "gap".to_owned(), samples: unusable });
    }
    let positive = |gap: Vec<f64>| gap.into_iter().map(|gap| if gap > 0.0 { gap } else { f64::NAN }).collect();
    let t = take(Role::Time).unwrap_or_default();
    let (v, v_l) = (take(Role::Speed).unwrap_or_default(), take(Role::LeadSpeed));
    let relative = || take(Role::RelativeSpeed).unwrap_or_default();
    let v_l = v_l.unwrap_or_else(|| v.iter().zip(relative()).map(|(v, relative)| v + relative).collect());
    let pair = Pair {
        car: 0,
        t: t.clone(),
        v: v.clone(),
        dv: v_l.iter().zip(&v).map(|(v_l, v)| v_l - v).collect(),
        gap: measured,
        headway,
        fronts,
    };
    let mut cars = Vec::new();
    if let Some(v) = take(Role::Lead2Speed) {
        cars.push(Car { v, ..Car::new(0, Some("car two ahead")) });
    }
    let len_l = length.as_ref().and_then(|length| crate::trajectory::import::median(length.iter().copied()));
    cars.push(Car {
        v: v_l,
        x: x_l,
        length: len_l,
        gap: take(Role::Lead2Gap).map(positive),
        ..Car::new(1, Some("preceding vehicle"))
    });
    cars.push(Car {
        v,
        x,
        gap: gap.map(positive),
        a: take(Role::Acceleration),
        sin_grade: take(Role::SinGrade),
        faults: faults(table, rows),
        ..Car::new(2, Some(follower))
    });
    notes.extend(table.drivers(rows, 2));
    let lines = rows.iter().map(|&row| table.lines[row]).collect();
    (Platoon { id, t, lines, cars, notes }, pair)
}
