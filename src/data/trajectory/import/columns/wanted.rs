//! Which columns of a file a map reads.

use super::map::{ColumnMap, Rows};
use super::role::Role;
use super::unit::Form;
use crate::trajectory::import::header::Header;
use crate::trajectory::import::problems::Problems;

/// One column of the file that is read.
pub(super) struct Wanted {
    pub place: usize,
    pub role: Role,
    /// Of a platoon; 0 elsewhere.
    pub car: usize,
    pub form: Form,
    pub unit: String,
}

/// The columns that the map names, in the order of its roles, and of the cars of a platoon.
pub(super) fn wanted(header: &Header, map: &ColumnMap, problems: &mut Problems) -> Vec<Wanted> {
    let mut wanted = Vec::new();
    let all: Vec<&str> = map.columns.iter().flat_map(|column| column.names.iter().map(String::as_str)).collect();
    let needed: Vec<&str> =
        map.columns.iter().filter(|c| !c.optional).filter_map(|c| c.names.first().map(String::as_str)).collect();
    let mut missing = Vec::new();
    let mut hints: Vec<&str> = Vec::new();
    let cars = if map.rows == Rows::Platoon { cars(header, map) } else { Vec::new() };
    for column in &map.columns {
        let before = wanted.len();
        let cars = if map.rows == Rows::Platoon && column.role.is_of_a_car() { cars.as_slice() } else { &[0] };
        for (position, &car) in cars.iter().enumerate() {
            let ahead = position.checked_sub(1).map(|ahead| cars[ahead]);
            let named = column.names.iter().filter_map(|name| numbered(name, car, ahead));
            let place = named.into_iter().find_map(|name| header.find_in_any_case(&name));
            wanted.extend(place.map(|place| {
                let (role, form, unit) = (column.role, column.form, column.unit.clone());
                // Internally, cars count from 1, whatever the numbers in the file.
                let car = if map.rows == Rows::Platoon && role.is_of_a_car() { position + 1 } else { 0 };
                Wanted { place, role, car, form, unit }
            }));
        }
        if wanted.len() == before && !column.optional {
            missing.push(column.names[0].as_str());
            if !column.hint.is_empty() && !hints.contains(&column.hint.as_str()) {
                hints.push(&column.hint);
            }
        }
    }
    // One name may be misspelt; if several are missing, the table may be another one.
    let other = format!("is {} the right column map? `leadlag list columns` shows those that are built in", map.name);
    let advice = match hints.as_slice() {
        [] if missing.len() > 1 => other,
        hints => hints.join("; "),
    };
    header.missing(&missing, &needed, &all, &advice, problems);
    wanted
}

/// Largest number of cars in one platoon.
const CARS_MAX: usize = 100;

/// The numbers of the cars of a platoon that have a speed.
fn cars(header: &Header, map: &ColumnMap) -> Vec<usize> {
    let names = map.column(Role::Speed).map(|column| column.names.as_slice()).unwrap_or_default();
    let has = |car: &usize| {
        let named = names.iter().filter_map(|name| numbered(name, *car, None));
        named.into_iter().any(|name| header.find_in_any_case(&name).is_some())
    };
    (0..=CARS_MAX).filter(has).collect()
}

/// The name of a column of one car: `{}` is its number, `{-1}` that of the car ahead. `None` without a car ahead.
fn numbered(name: &str, car: usize, ahead: Option<usize>) -> Option<String> {
    if name.contains("{-1}") {
        return Some(name.replace("{-1}", &ahead?.to_string()).replace("{}", &car.to_string()));
    }
    Some(name.replace("{}", &car.to_string()))
}
