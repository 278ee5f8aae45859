//! `Labels.csv` of the paper's authors: the car of each position, and its length.

use super::header::{Header, column_of, split};
use super::lines::Lines;
use super::median;
use super::number::present;
use super::problems::{Problems, Stop};
use crate::trajectory::error::{ImportError, ProblemKind};
use crate::trajectory::{Note, Platoon, Source};
use std::collections::HashMap;
use std::io::Read;

/// Cars per platoon in this table.
const CARS: usize = 5;

/// The table: file stem to cars, front to back.
#[derive(Debug, Clone)]
pub struct Labels {
    /// The file.
    pub source: Source,
    rows: HashMap<String, Vec<Label>>,
}

/// One car of one platoon.
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// Name of the car model.
    pub name: String,
    /// Overall length \[m\].
    pub length: f64,
}

impl Labels {
    /// Reads the table; `name` stands for the file in messages.
    pub fn read_from(input: impl Read, name: &str) -> Result<Self, ImportError> {
        let mut problems = Problems::default();
        let mut lines = Lines::new(input);
        let rows = rows(&mut lines, &mut problems);
        let rows = problems.finish(name, rows)?;
        let source = Source { path: name.to_owned(), sha256: lines.sha256() };
        Ok(Labels { source, rows })
    }

    /// The cars of a platoon, front to back.
    pub fn get(&self, file_stem: &str) -> Option<&[Label]> {
        self.rows.get(file_stem).map(Vec::as_slice)
    }
}

/// Names and lengths from the table beside the file; lengths it does not give follow from the positions.
pub(super) fn name_cars(platoon: &mut Platoon, file_stem: &str, labels: Option<&Labels>) {
    let found = labels.and_then(|labels| labels.get(file_stem));
    for car in &mut platoon.cars {
        if let Some(label) = found.and_then(|labels| labels.get(car.number - 1)) {
            car.name.clone_from(&label.name);
            car.length = Some(label.length);
        }
    }
    for follower in 1..platoon.cars.len() {
        let (front, back) = platoon.cars.split_at_mut(follower);
        let (Some(front), back) = (front.last_mut(), &back[0]) else {
            continue;
        };
        let (Some(x_l), Some(x_f), Some(gap)) = (&front.x, &back.x, &back.gap) else {
            continue;
        };
        if front.length.is_none() {
            let differences = (0..gap.len()).map(|i| x_l[i] - x_f[i] - gap[i]);
            if let Some(length) = median(differences) {
                front.length = Some(length);
                platoon.notes.push(Note::LengthDerived {
                    car: front.number,
                    length_m: length,
                    from: "positions and spacing".to_owned(),
                });
            }
        }
    }
}

fn rows<R: Read>(lines: &mut Lines<R>, problems: &mut Problems) -> Result<HashMap<String, Vec<Label>>, Stop> {
    let Some(text) = lines.next(problems)?.map(str::to_owned) else {
        return Err(problems.stop(1, None, ProblemKind::Empty));
    };
    let header = Header::parse(&text, 1, problems)?;
    let mut needed = vec!["File".to_owned()];
    needed.extend((1..=CARS).map(|k| format!("type{k}")));
    needed.extend((1..=CARS).map(|k| format!("length{k}")));
    let needed: Vec<&str> = needed.iter().map(String::as_str).collect();
    header.require(&needed, &needed, "", problems);
    problems.check()?;
    let place: Vec<usize> = needed.iter().filter_map(|n| header.find(n)).collect();
    let mut rows = HashMap::new();
    while let Some(text) = lines.next(problems)?.map(str::to_owned) {
        let line = lines.number();
        let mut fields = Vec::new();
        split(&text, &mut fields);
        if fields.iter().all(|field| field.text.is_empty()) {
            continue;
        }
        if fields.len() < header.names.len() {
            let kind =
                ProblemKind::FieldCount { expected: header.names.len(), found: fields.len(), last: !lines.terminated };
            problems.add(line, Some(1), kind);
            continue;
        }
        let mut cars = Vec::with_capacity(CARS);
        for car in 0..CARS {
            let column = place[1 + CARS + car];
            let name = &header.names[column];
            match length(fields[column].text, name) {
                Ok(length) => cars.push(Label { name: model(fields[place[1 + car]].text, car + 1), length }),
                Err(kind) => {
                    problems.add(line, Some(column_of(&text, fields[column].start)), kind);
                }
            }
        }
        rows.insert(fields[place[0]].text.to_owned(), cars);
    }
    Ok(rows)
}

fn length(text: &str, column: &str) -> Result<f64, ProblemKind> {
    let found = present(text, column)?;
    if (0.5..=30.0).contains(&found) {
        Ok(found)
    } else {
        let column = column.to_owned();
        Err(ProblemKind::Length { column, found })
    }
}

/// Name of a car model by its type id; ids beyond 5 belong to cars without a vehicle table.
fn model(id: &str, number: usize) -> String {
    match id {
        "1" => "Audi A8 (platoon leader)".to_owned(),
        "2" => "Tesla Model 3".to_owned(),
        "3" => "BMW X5".to_owned(),
        "4" => "Audi A6".to_owned(),
        "5" => "Mercedes A Class".to_owned(),
        _ => format!("car {number} (type {id})"),
    }
}
