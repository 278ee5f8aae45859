//! Wide tables of more than two cars: one row per time, and for each car columns with its number in the name.

use super::map::ColumnMap;
use super::pairs::Group;
use super::plausible::Pair;
use super::role::Role;
use super::rows::Table;
use crate::trajectory::error::{Problem, ProblemKind};
use crate::trajectory::import::median;
use crate::trajectory::import::number::REVERSE_LIMIT;
use crate::trajectory::{Car, Note, Platoon};

/// Cars one behind the other.
pub(super) fn platoon(table: &Table, map: &ColumnMap, group: Group, pairs: &mut Vec<Pair>) -> Platoon {
    let Group { id, rows, .. } = &group;
    let take = |role: Role, car: usize| {
        table.numbers_of(role, car).map(|all| rows.iter().map(|&row| all[row]).collect::<Vec<f64>>())
    };
    let t: Vec<f64> =
        table.numbers(Role::Time).map(|all| rows.iter().map(|&row| all[row]).collect()).unwrap_or_default();
    let mut notes = Vec::new();
    let mut cars: Vec<Car> = Vec::new();
    let numbers = table.cars();
    for &number in &numbers {
        let length = take(Role::Length, number).and_then(|length| median(length.into_iter())).or(map.length);
        // Every car but the last one has a follower.
        let length = map.lead_override.filter(|_| numbers.last() != Some(&number)).or(length);
        let [faults, gap_faults] = table.faults_of(rows, number);
        let mut car = Car {
            length: length.filter(|&length| length > 0.0),
            v: take(Role::Speed, number).unwrap_or_default(),
            x: take(Role::Position, number),
            a: take(Role::Acceleration, number),
            sin_grade: take(Role::SinGrade, number),
            faults,
            gap_faults,
            ..Car::new(number, None)
        };
        if let Some((row, &found)) = rows.iter().zip(&car.v).find(|(_, v)| **v < REVERSE_LIMIT) {
            let kind = ProblemKind::MappedReverse {
                column: table.called_of(Role::Speed, number),
                limit: REVERSE_LIMIT,
                found,
            };
            car.faults.add(Problem { line: table.lines[*row], column: None, kind });
        }
        if let Some(lead) = cars.last() {
            let measured = take(Role::Gap, number);
            let headway = take(Role::Headway, number);
            let gap = measured.clone().or_else(|| {
                let (headway, length) = (headway.as_ref()?, lead.length?);
                notes.push(Note::Derived {
                    signal: format!("gap of car {number}"),
                    from: format!("headway minus the length of the vehicle ahead, {length} m"),
                });
                Some(headway.iter().map(|headway| headway - length).collect())
            });
            if let Some(gap) = gap {
                let gap = table.above_0(gap, rows, (Role::Gap, number), number, &format!("gap of car {number}"));
                notes.extend(gap.note);
                car.gap_faults.merge(gap.faults);
                car.gap = Some(gap.values);
            }
            let fronts = lead.x.as_ref().zip(car.x.as_ref());
            pairs.push(Pair {
                car: number,
                t: t.clone(),
                v: car.v.clone(),
                dv: lead.v.iter().zip(&car.v).map(|(lead, ego)| lead - ego).collect(),
                gap: measured,
                headway,
                fronts: fronts
                    .map(|(lead, ego)| lead.iter().zip(ego).map(|(lead, ego)| map.ahead_by(lead - ego)).collect()),
            });
        }
        cars.push(car);
    }
    for number in numbers {
        notes.extend(table.drivers(rows, number, number));
    }
    let lines = rows.iter().map(|&row| table.lines[row]).collect();
    Platoon { id: id.clone(), t, lines, cars, notes }
}
