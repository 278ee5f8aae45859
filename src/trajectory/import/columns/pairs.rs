//! Wide tables: one row per time of a follower and the vehicle ahead of it.

use super::map::ColumnMap;
use super::plausible::{self, Pair};
use super::role::Role;
use super::rows::{Repeated, Table};
use crate::trajectory::error::ProblemKind;
use crate::trajectory::import::note_end;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::{Car, Note, Platoon};

/// Backwards faster than this is no sensor noise at standstill \[m/s\].
const REVERSE_LIMIT: f64 = -0.5;

/// Rows by group, in the order of the file.
pub(super) type Groups = Vec<(Option<u32>, Vec<usize>)>;

/// The rows of each group, whose times must rise; rows that repeat another one are taken once.
pub(super) fn by_group(table: &Table, problems: &mut Problems) -> Result<(Groups, Repeated), Stop> {
    let mut groups: Groups = Vec::new();
    let mut place = std::collections::HashMap::new();
    for row in 0..table.lines.len() {
        let group = table.names(Role::Group).map(|group| group[row]);
        let at = *place.entry(group).or_insert_with(|| {
            groups.push((group, Vec::new()));
            groups.len() - 1
        });
        groups[at].1.push(row);
    }
    let time = table.numbers(Role::Time).expect("a map without it is refused");
    let mut repeated = Repeated::default();
    for (_, rows) in &mut groups {
        table.take_once(rows, &mut repeated, |first, line, found| {
            problems.add(line, None, ProblemKind::TimeTwice { column: table.called(Role::Time), found, first });
        });
        for pair in rows.windows(2).filter(|pair| time[pair[1]] < time[pair[0]]) {
            let (previous, found) = (time[pair[0]], time[pair[1]]);
            let kind = ProblemKind::TimeBack { column: table.called(Role::Time), previous, found };
            problems.add(table.lines[pair[1]], None, kind);
        }
    }
    problems.check()?;
    Ok((groups, repeated))
}

/// One platoon per group, in the order of the file.
pub(super) fn platoons(table: &Table, map: &ColumnMap, problems: &mut Problems) -> Result<Vec<Platoon>, Stop> {
    let (groups, repeated) = by_group(table, problems)?;
    for role in [Role::Speed, Role::LeadSpeed, Role::Lead2Speed] {
        for (row, &found) in table.numbers(role).unwrap_or_default().iter().enumerate() {
            if found < REVERSE_LIMIT {
                let kind = ProblemKind::MappedReverse { column: table.called(role), limit: REVERSE_LIMIT, found };
                problems.add(table.lines[row], None, kind);
            }
        }
    }
    problems.check()?;
    let mut platoons = Vec::new();
    let mut pairs = Vec::new();
    for (group, rows) in groups.iter().filter(|(_, rows)| rows.len() > 1) {
        let id = group.map(|group| table.dictionary[group as usize].clone());
        let (platoon, pair) = platoon(table, map, id, rows);
        platoons.push(platoon);
        pairs.push(pair);
    }
    if !platoons.iter().any(Platoon::is_usable) {
        table.refuse(problems)?;
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

fn platoon(table: &Table, map: &ColumnMap, id: Option<String>, rows: &[usize]) -> (Platoon, Pair) {
    let take = |role: Role| table.numbers(role).map(|all| rows.iter().map(|&row| all[row]).collect::<Vec<f64>>());
    let mut notes = Vec::new();
    let length = take(Role::LeadLength).or_else(|| Some(vec![map.lead_length?; rows.len()]));
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
    let (v, v_l) = (take(Role::Speed).unwrap_or_default(), take(Role::LeadSpeed).unwrap_or_default());
    let pair =
        Pair { t: t.clone(), dv: v_l.iter().zip(&v).map(|(v_l, v)| v_l - v).collect(), gap: measured, headway, fronts };
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
        faults: table.faults(table.key(rows[0])).cloned().unwrap_or_default(),
        ..Car::new(2, Some("follower"))
    });
    let lines = rows.iter().map(|&row| table.lines[row]).collect();
    (Platoon { id, t, lines, cars, notes }, pair)
}
