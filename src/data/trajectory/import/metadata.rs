//! The five lines of metadata of OpenACC files, which name the cars.

use super::header::{Header, split};
use super::lines::Lines;
use super::problems::{Problems, Stop};
use crate::trajectory::error::ProblemKind;
use crate::trajectory::{Layout, Platoon};
use std::io::Read;

/// First words of the lines, in file order.
const METADATA: [&str; 5] = ["Date", "Vehicle_order", "Number_of_vehicles", "ACC", "Distance_setting"];

/// The names of the cars, none without metadata, and the header; the first line of the file is `line`.
pub(super) fn read<R: Read>(
    mut line: String,
    lines: &mut Lines<R>,
    problems: &mut Problems,
) -> Result<(Vec<String>, Header), Stop> {
    let mut fields = Vec::new();
    split(&line, &mut fields);
    if fields.iter().any(|field| field.text.eq_ignore_ascii_case("Time")) {
        return Ok((Vec::new(), Header::parse(&line, lines.number(), problems)?));
    }
    let mut names = Vec::new();
    for (index, expected) in METADATA.into_iter().enumerate() {
        if index > 0 {
            line = lines.next(problems)?.unwrap_or_default().to_owned();
        }
        let mut fields = Vec::new();
        split(&line, &mut fields);
        if !fields[0].text.eq_ignore_ascii_case(expected) {
            let kind = ProblemKind::Metadata { expected, found: line };
            return Err(problems.stop(lines.number().max(index as u64 + 1), Some(1), kind));
        }
        if expected == "Vehicle_order" {
            names = fields[1..].iter().map(|field| field.text.to_owned()).collect();
        }
    }
    let Some(text) = lines.next(problems)?.map(str::to_owned) else {
        return Err(problems.stop(METADATA.len() as u64, None, ProblemKind::NoHeader));
    };
    Ok((names, Header::parse(&text, lines.number(), problems)?))
}

/// Files of OpenACC have positions; rebuilt ones have nothing but speeds, gaps and drivers.
pub(super) fn layout(header: &Header) -> Layout {
    let is_more = |name: &String| {
        let signal = name.trim_end_matches(|c: char| c.is_ascii_digit());
        signal.len() < name.len() && !matches!(signal, "Speed" | "IVS" | "Driver")
    };
    if header.names.iter().any(is_more) { Layout::OpenAcc } else { Layout::AstazeroRebuilt }
}

/// Gives the cars of a platoon their names.
pub(super) fn name_cars(platoon: &mut Platoon, names: &[String]) {
    for car in &mut platoon.cars {
        if let Some(name) = names.get(car.number.wrapping_sub(1)).filter(|name| !name.is_empty()) {
            car.name.clone_from(name);
        }
    }
}
