//! Wide tables: one row per time of a follower and the vehicle ahead of it.

use super::map::ColumnMap;
use super::plausible::{self, Pair};
use super::role::Role;
use super::rows::Table;
use crate::trajectory::error::ProblemKind;
use crate::trajectory::import::note_end;
use crate::trajectory::import::problems::{Problems, Stop};
use crate::trajectory::{Car, Note, Platoon};

/// Backwards faster than this is no sensor noise at standstill \[m/s\].
const REVERSE_LIMIT: f64 = -0.5;

/// One platoon per group, in the order of the file.
pub(super) fn platoons(table: &Table, map: &ColumnMap, problems: &mut Problems) -> Result<Vec<Platoon>, Stop> {
    let mut groups: Vec<(Option<u32>, Vec<usize>)> = Vec::new();
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
    for (_, rows) in &groups {
        for pair in rows.windows(2) {
            let (previous, found) = (time[pair[0]], time[pair[1]]);
            let column = table.called(Role::Time);
            let kind = match found.total_cmp(&previous) {
                std::cmp::Ordering::Greater => continue,
                std::cmp::Ordering::Equal => ProblemKind::TimeTwice { column, found },
                std::cmp::Ordering::Less => ProblemKind::TimeBack { column, previous, found },
            };
            problems.add(table.lines[pair[1]], None, kind);
        }
    }
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
        let (platoon, pair) = platoon(table, id, rows);
        platoons.push(platoon);
        pairs.push(pair);
    }
    let Some(first) = platoons.first_mut() else {
        return Err(problems.stop(table.lines[0], None, ProblemKind::OneRow));
    };
    if map.check_units {
        plausible::pairs(table, &pairs, problems);
        problems.check()?;
    }
    if !table.ignored.is_empty() {
        first.notes.push(Note::IgnoredColumns { columns: table.ignored.clone() });
    }
    note_end(table.terminated, &table.lines, &mut first.notes);
    Ok(platoons)
}

fn platoon(table: &Table, id: Option<String>, rows: &[usize]) -> (Platoon, Pair) {
    let take = |role: Role| table.numbers(role).map(|all| rows.iter().map(|&row| all[row]).collect::<Vec<f64>>());
    let mut notes = Vec::new();
    let length = take(Role::LeadLength);
    let (x, x_l) = (take(Role::Position), take(Role::LeadPosition));
    let minus_length = |of: &[f64]| -> Vec<f64> {
        let length = length.as_deref().unwrap_or_default();
        of.iter().zip(length).map(|(of, length)| of - length).collect()
    };
    let headway = take(Role::Headway);
    let measured = take(Role::Gap);
    let fronts: Option<Vec<f64>> =
        x.as_ref().zip(x_l.as_ref()).map(|(x, x_l)| x.iter().zip(x_l).map(|(x, x_l)| x_l - x).collect());
    let mut derived = |from: &str| {
        notes.push(Note::Derived { signal: "gap".to_owned(), from: from.to_owned() });
    };
    let gap = match (&measured, &headway, &fronts) {
        (Some(gap), ..) => gap.clone(),
        (None, Some(headway), _) => {
            derived("headway minus the length of the vehicle ahead");
            minus_length(headway)
        }
        (None, None, fronts) => {
            derived("positions and the length of the vehicle ahead");
            minus_length(fronts.as_deref().unwrap_or_default())
        }
    };
    let unusable = gap.iter().filter(|&&gap| gap <= 0.0).count();
    if unusable > 0 {
        notes.push(Note::NoGap { samples: unusable });
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
        gap: Some(positive(gap)),
        a: take(Role::Acceleration),
        sin_grade: take(Role::SinGrade),
        ..Car::new(2, Some("follower"))
    });
    let lines = rows.iter().map(|&row| table.lines[row]).collect();
    (Platoon { id, t, lines, cars, notes }, pair)
}
