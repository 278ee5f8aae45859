//! Tables of any layout by a column map: meaning and unit of each column.
//!
//! A map is a TOML file; those of well-known sets are built in. Long tables (one row per vehicle and time)
//! become one platoon of two cars per stretch in which a vehicle follows another one, the longest first.

mod clock;
mod error;
mod guess;
mod map;
mod pairs;
mod platoon;
mod plausible;
mod role;
mod rows;
mod text;
mod trajectory;
mod ultra_av;
mod unit;
mod vehicles;
mod wanted;

pub use error::MapError;
pub use map::ColumnMap;

use super::header::{Header, nearest};
use super::lines::Lines;
use super::problems::{Problems, Stop};
use crate::text::bounded::TEXT_MAX;
use crate::trajectory::error::ProblemKind;
use crate::trajectory::{ChosenBy, ImportError, Layout, Note, Platoon, Recording, Source};
use std::io::Read;
use std::path::Path;
use text::{Rows, Separator};
use wanted::Names;

/// Name and text of the maps that users name.
const SHIPPED: [(&str, &str); 8] = [
    ("ngsim", include_str!("maps/ngsim.toml")),
    ("highd", include_str!("maps/highd.toml")),
    ("exid", include_str!("maps/exid.toml")),
    ("tgsim", include_str!("maps/tgsim.toml")),
    ("i24-motion", include_str!("maps/i24-motion.toml")),
    ("waymo-pairs", include_str!("maps/waymo-pairs.toml")),
    ("fhwa-cav", include_str!("maps/fhwa-cav.toml")),
    ("sumo-fcd", include_str!("maps/sumo-fcd.toml")),
];

impl ColumnMap {
    /// Name and text of the built-in maps.
    pub fn shipped() -> &'static [(&'static str, &'static str)] {
        &SHIPPED
    }

    /// A built-in map by its name, or your own map: its file, which ends in `.toml`, or its text, which has several lines.
    pub fn find(given: &str) -> Result<ColumnMap, MapError> {
        if let Some((name, text)) = SHIPPED.iter().find(|(name, _)| *name == given) {
            return ColumnMap::parse(text, name);
        }
        if given.contains('\n') {
            return ColumnMap::parse(given, "columns");
        }
        let known: Vec<&'static str> = SHIPPED.iter().map(|(name, _)| *name).collect();
        if Path::new(given).extension().is_none_or(|extension| extension != "toml") {
            let near = nearest(given, known.iter().copied()).map(str::to_owned);
            return Err(MapError::Unknown { name: given.to_owned(), known, near });
        }
        let text = crate::text::bounded::read_to_string(Path::new(given), TEXT_MAX)
            .map_err(|source| MapError::Open { path: given.to_owned(), source })?;
        ColumnMap::parse(&text, given)
    }
}

/// Reads a table by a column map.
pub fn read_mapped(path: &Path, map: &ColumnMap) -> Result<Recording, ImportError> {
    let (input, is_parquet) = super::opened(path)?;
    let written_alike = is_parquet.then(|| map.clone().of_plain_csv());
    read_mapped_from(input, &path.display().to_string(), written_alike.as_ref().unwrap_or(map))
}

/// Reads a table by a column map from a stream; `name` stands for the file in messages.
pub fn read_mapped_from(input: impl Read, name: &str, map: &ColumnMap) -> Result<Recording, ImportError> {
    let mut problems = Problems::default();
    let mut lines = Lines::new(input);
    let mut notes = Vec::new();
    let header = rows::header(&mut lines, map, &mut problems, &mut notes);
    let table = header.and_then(|header| rows::read(&mut lines, header, map, notes, &mut problems));
    let result = table.and_then(|table| platoons(&table, map, &mut problems));
    let mut platoons = problems.finish(name, result)?;
    for platoon in &mut platoons {
        platoon.notes.insert(0, Note::Mapped { map: map.name.clone(), pair: platoon.id.clone() });
    }
    Ok(Recording {
        source: Source { path: name.to_owned(), sha256: lines.sha256() },
        layout: Layout::Columns,
        platoons,
        companions: Vec::new(),
        grade: None,
        chosen_by: match map.rows {
            Rows::Vehicles => ChosenBy::Vehicle,
            Rows::Pairs => ChosenBy::Group,
            Rows::Platoon => ChosenBy::Place,
        },
    })
}

fn platoons(table: &rows::Table, map: &ColumnMap, problems: &mut Problems) -> Result<Vec<Platoon>, Stop> {
    match map.rows {
        Rows::Vehicles => vehicles::platoons(table, map, problems),
        Rows::Pairs => pairs::of_groups(table, map, problems, pairs::platoon),
        Rows::Platoon if table.cars().len() < 2 => {
            let kind = ProblemKind::FewCars { found: table.cars().len() };
            Err(problems.stop(table.header_line.max(1), None, kind))
        }
        Rows::Platoon => pairs::of_groups(table, map, problems, platoon::platoon),
    }
}

/// Reads a table of a layout below its header; `notes` say what was skipped before.
pub(super) fn read_layout<R: Read>(
    lines: &mut Lines<R>,
    header: Header,
    (layout, map): (Layout, &ColumnMap),
    notes: Vec<Note>,
    problems: &mut Problems,
) -> Result<Vec<Platoon>, Stop> {
    let table = rows::read(lines, (header, Separator::Comma), map, notes, problems)?;
    let mut platoons = platoons(&table, map, problems)?;
    if layout == Layout::UltraAv {
        platoons.iter_mut().for_each(|platoon| ultra_av::complete(platoon, &table));
    }
    Ok(platoons)
}

impl ColumnMap {
    /// The names that are typical of a layout, with two cars.
    pub(super) fn typical(&self) -> Vec<String> {
        let names = |layout| Names { map: self, layout, cars: &[1, 2] }.typical();
        self.layout.as_ref().map(names).unwrap_or_default()
    }
}

/// Name of a vehicle of a long table.
fn vehicle_name(id: &str) -> String {
    format!("vehicle {id}")
}

impl Recording {
    /// True for a table of platoons: its cars are numbered, as in the layouts that need no map.
    pub fn is_of_numbered_cars(&self) -> bool {
        self.chosen_by == ChosenBy::Place
    }

    /// Keeps only the platoons in which the car of this name is the follower with the same number as in the first: 1 is the car right
    /// behind the leader. `None`, and no change, without such a platoon.
    pub fn keep_car(&mut self, name: &str) -> Option<usize> {
        let place = |platoon: &Platoon| {
            let followers = platoon.cars.iter().filter(|car| car.number > 1);
            let number = |car: &crate::trajectory::Car| car.number;
            let exact = followers.clone().find(|car| car.name == name).map(number);
            exact.or_else(|| followers.clone().find(|car| car.name.eq_ignore_ascii_case(name)).map(number))
        };
        let car = self.platoons.iter().find_map(place)?;
        self.platoons.retain(|platoon| place(platoon) == Some(car));
        Some(car - 1)
    }

    /// Keeps only the pairs of a mapped table whose follower has this id, that of its vehicle or group, or the one pair of this id; false, and nothing
    /// changed, without such a pair.
    pub fn keep_follower(&mut self, id: &str) -> bool {
        let name = match self.chosen_by {
            ChosenBy::Place => return false,
            ChosenBy::Vehicle => vehicle_name(id),
            ChosenBy::Group => id.to_owned(),
        };
        let follows = |platoon: &Platoon| {
            platoon.id.as_deref() == Some(id) || platoon.cars.last().is_some_and(|car| car.name == name)
        };
        if !self.platoons.iter().any(follows) {
            return false;
        }
        self.platoons.retain(follows);
        true
    }
}
