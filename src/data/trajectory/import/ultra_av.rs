//! Ultra-AV and Open-PAV tables: many leader-follower pairs in one file, by trajectory id.
//!
//! Built from the documentation (Zhou et al. 2024, Scientific Data, Table 1), not tested on its files:
//! `Time_Index` in s, `Spatial_Gap` bumper to bumper, `Spatial_Headway` centre to centre.

use super::header::{Header, OWN_NAMES};
use super::lines::Lines;
use super::problems::{Problems, Stop};
use super::table::{Meaning, Table, Wanted, read_rows};
use crate::trajectory::{Car, Faults, Note, Platoon};
use std::collections::{HashMap, HashSet};
use std::io::Read;

pub(super) const COLUMNS: &[&str] = &[
    "Trajectory_ID",
    "Time_Index",
    "Speed_LV",
    "Speed_FAV",
    "Spatial_Gap",
    "ID_LV",
    "Type_LV",
    "Pos_LV",
    "Acc_LV",
    "ID_FAV",
    "Pos_FAV",
    "Acc_FAV",
    "Spatial_Headway",
    "Speed_Diff",
];
const NEEDED: &[&str] = &["Trajectory_ID", "Time_Index", "Speed_LV", "Speed_FAV", "Spatial_Gap"];
const TEXTS: [&str; 4] = ["Trajectory_ID", "ID_LV", "Type_LV", "ID_FAV"];
const NUMBERS: [(&str, Meaning); 9] = [
    ("Time_Index", Meaning::Time),
    ("Speed_LV", Meaning::Speed),
    ("Speed_FAV", Meaning::Speed),
    ("Spatial_Gap", Meaning::Spacing),
    ("Spatial_Headway", Meaning::Spacing),
    ("Pos_LV", Meaning::Position),
    ("Acc_LV", Meaning::Number),
    ("Pos_FAV", Meaning::Position),
    ("Acc_FAV", Meaning::Number),
];

/// Reads the file whose first line is `first`; one platoon of two cars per trajectory id.
pub(super) fn read<R: Read>(
    first: &str,
    lines: &mut Lines<R>,
    problems: &mut Problems,
    skipped: &mut Vec<Note>,
) -> Result<Vec<Platoon>, Stop> {
    let header = Header::parse(first, lines.number(), problems)?;
    header.require(NEEDED, COLUMNS, OWN_NAMES, problems);
    let ignored = header.unknown(NEEDED, COLUMNS, problems);
    problems.check()?;
    let texts: Vec<(&str, usize)> =
        TEXTS.into_iter().filter_map(|name| header.find(name).map(|column| (name, column))).collect();
    let numbers: Vec<(&str, usize, Meaning)> = NUMBERS
        .into_iter()
        .filter_map(|(name, meaning)| header.find(name).map(|column| (name, column, meaning)))
        .collect();
    let wanted = Wanted {
        numbers: numbers.iter().map(|&(_, c, m)| (c, m)).collect(),
        texts: texts.iter().map(|&(_, c)| c).collect(),
        group: Some(0),
    };
    let table = read_rows(lines, &header, &wanted, problems, skipped)?;
    let columns = Columns {
        texts: texts.iter().map(|&(name, _)| name).collect(),
        numbers: numbers.iter().map(|&(name, _, _)| name).collect(),
        table,
    };
    let mut platoons: Vec<Platoon> = columns.platoons();
    if !platoons.iter().any(Platoon::is_usable) {
        columns.table.refuse(problems)?;
    }
    for platoon in &mut platoons {
        if !ignored.is_empty() {
            let columns = ignored.clone();
            platoon.notes.push(Note::IgnoredColumns { columns });
        }
    }
    if let Some(last) = platoons.last_mut() {
        super::note_end(columns.table.terminated, &columns.table.lines, &mut last.notes);
    }
    Ok(platoons)
}

struct Columns<'a> {
    texts: Vec<&'a str>,
    numbers: Vec<&'a str>,
    table: Table,
}

impl Columns<'_> {
    /// One platoon per trajectory, in order of appearance. Of trajectories with the same id the later ones are numbered.
    fn platoons(&self) -> Vec<Platoon> {
        let groups = self.groups();
        let ids: HashSet<&str> = groups.iter().map(|(id, ..)| *id).collect();
        let mut given: HashSet<String> = HashSet::new();
        let mut platoons = Vec::with_capacity(groups.len());
        for (id, piece, rows) in &groups {
            let mut platoon = self.platoon((id, *piece), rows);
            if *piece > 0 {
                let numbered = (*piece + 1..).map(|number| format!("{id}.{number}"));
                let free = numbered.into_iter().find(|new| !ids.contains(new.as_str()) && !given.contains(new));
                let new = free.expect("one of infinitely many numbers is free");
                let line = self.table.lines[rows[0]];
                let note = Note::IdAgain { id: (*id).to_owned(), line, read_as: new.clone() };
                platoon.notes.insert(0, note);
                given.insert(new.clone());
                platoon.id = Some(new);
            }
            platoons.push(platoon);
        }
        if let Some(first) = platoons.first_mut() {
            first.notes.extend(self.table.repeated.clone());
        }
        platoons
    }

    /// Trajectory ids in order of appearance, each with which of its trajectories it is and its rows.
    fn groups(&self) -> Vec<(&str, u32, Vec<usize>)> {
        let changes = &self.table.texts[0];
        let mut order: Vec<(&str, u32, Vec<usize>)> = Vec::new();
        let mut place: HashMap<(&str, u32), usize> = HashMap::new();
        for (i, (start, id)) in changes.iter().enumerate() {
            let end = changes.get(i + 1).map_or(self.table.lines.len(), |next| next.0);
            for row in *start..end {
                let piece = self.table.pieces[row];
                let at = *place.entry((id, piece)).or_insert_with(|| {
                    order.push((id, piece, Vec::new()));
                    order.len() - 1
                });
                order[at].2.push(row);
            }
        }
        order
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.numbers.iter().position(|n| *n == name)
    }

    /// Faults of some of the columns of a trajectory.
    fn faults(&self, piece: (&str, u32), names: &[&str]) -> Faults {
        let mut faults = Faults::default();
        names
            .iter()
            .filter_map(|name| self.place(name))
            .for_each(|place| faults.merge(self.table.faults(piece, place)));
        faults
    }

    fn text(&self, name: &str, row: usize) -> Option<&str> {
        let changes = &self.table.texts[self.texts.iter().position(|n| *n == name)?];
        let next = changes.partition_point(|(start, _)| *start <= row);
        changes.get(next.checked_sub(1)?).map(|(_, text)| text.as_str())
    }

    fn numbers(&self, name: &str, rows: &[usize]) -> Option<Vec<f64>> {
        let values = &self.table.numbers[self.place(name)?];
        Some(rows.iter().map(|&row| values[row]).collect())
    }

    fn platoon(&self, (id, piece): (&str, u32), rows: &[usize]) -> Platoon {
        let numbers = |name: &str| self.numbers(name, rows);
        let gap = numbers("Spatial_Gap").unwrap_or_default();
        let headway = numbers("Spatial_Headway");
        let mut notes: Vec<Note> = self
            .place("Spatial_Gap")
            .and_then(|gap| self.table.no_gap((id, piece), gap, 2, "Spatial_Gap"))
            .into_iter()
            .collect();
        // Centre to centre minus bumper to bumper is the mean of the two lengths; the files contain no more.
        let length = headway.and_then(|h| super::median(h.iter().zip(&gap).map(|(h, g)| h - g)));
        let length = length.filter(|&length| length > 0.0);
        if let Some(length_m) = length {
            notes.push(Note::LengthDerived {
                car: 1,
                length_m,
                from: "headway and gap, for cars of equal length".to_owned(),
            });
        }
        let times = numbers("Time_Index").unwrap_or_default();
        let began = times.first().map(|&t_s| (t_s, "automated"));
        notes.extend(super::driver_modes(2, began.into_iter()));
        let text = |name: &str| self.text(name, rows[0]).unwrap_or_default();
        let human = text("Type_LV") == "0" || text("ID_LV") == "-1";
        let leader = if human { "human-driven".to_owned() } else { format!("automated vehicle {}", text("ID_LV")) };
        let follower = format!("automated vehicle {}", text("ID_FAV"));
        Platoon {
            id: Some(id.to_owned()),
            t: times,
            lines: rows.iter().map(|&row| self.table.lines[row]).collect(),
            cars: vec![
                Car {
                    length,
                    v: numbers("Speed_LV").unwrap_or_default(),
                    x: numbers("Pos_LV"),
                    a: numbers("Acc_LV"),
                    faults: self.faults((id, piece), &["Speed_LV", "Pos_LV", "Acc_LV"]),
                    ..Car::new(1, Some(leader.trim()))
                },
                Car {
                    length,
                    v: numbers("Speed_FAV").unwrap_or_default(),
                    x: numbers("Pos_FAV"),
                    a: numbers("Acc_FAV"),
                    faults: self.faults((id, piece), &["Speed_FAV", "Pos_FAV", "Acc_FAV"]),
                    gap_faults: self.faults((id, piece), &["Spatial_Gap", "Spatial_Headway"]),
                    gap: Some(gap),
                    ..Car::new(2, Some(follower.trim()))
                },
            ],
            notes,
        }
    }
}
