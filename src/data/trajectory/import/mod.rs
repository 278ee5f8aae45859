//! From a file to a [`Recording`]: one reader of tables, and a map of the columns for each layout.
//!
//! Input is not trusted: a table is bounded in text and in memory, a line by 1 MiB (`text::bounded`), and every refused value is named
//! with its place. Missing values (an empty field, `NaN`, `nan`) become NaN; nothing is repaired here.

mod columns;
mod header;
mod kind;
mod labels;
mod layout;
mod lines;
mod metadata;
mod number;
#[cfg_attr(not(feature = "parquet"), path = "no_parquet.rs")]
mod parquet;
mod preamble;
mod problems;

pub use columns::{ColumnMap, MapError, read_mapped, read_mapped_from};
pub(super) use header::{Field, Header, column_of, split};
pub use labels::{Label, Labels};
pub use layout::{Layout, UnknownLayout};
pub(super) use lines::Lines;
pub(super) use number::{GRADE_LIMIT, POSITION_LIMIT, present};
pub(super) use problems::{Problems, Stop};

use super::error::{ImportError, ProblemKind};
use super::{ChosenBy, Grade, Note, Recording, Source};
use crate::statistics::upper_median;
use flate2::bufread::MultiGzDecoder;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Names and lengths of the cars, beside the files of the authors' processed layout.
const LABELS: &str = "Labels.csv";
/// The grade of the road, likewise.
const SLOPE: &str = "Slope.csv";

/// True for a table that accompanies others and has no trajectories itself.
pub fn is_companion(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name == LABELS || name == SLOPE)
}

/// Reads a file of measured trajectories; without a layout, the header decides.
///
/// For the authors' processed layout `Labels.csv` (names, lengths) and `Slope.csv` (grade) are read from the
/// same folder if they exist.
pub fn read(path: &Path, layout: Option<Layout>) -> Result<Recording, ImportError> {
    let name = path.display().to_string();
    let mut recording = read_from(open(path)?, &name, layout)?;
    if recording.layout == Layout::AstazeroProcessed {
        let labels_path = path.with_file_name(LABELS);
        let labels = if labels_path.exists() {
            let name = labels_path.display().to_string();
            Some(Labels::read_from(open(&labels_path)?, &name)?)
        } else {
            None
        };
        add_labels(&mut recording, labels.as_ref());
        let slope_path = path.with_file_name(SLOPE);
        if slope_path.exists() {
            let grade = Grade::read_csv(&slope_path)?;
            recording.companions.extend(grade.source.clone());
            recording.grade = Some(grade);
        }
    }
    Ok(recording)
}

/// Reads measured trajectories from memory; `name` stands for the file in messages. No companion files are read.
pub fn read_bytes(bytes: &[u8], name: &str, layout: Option<Layout>) -> Result<Recording, ImportError> {
    let mut recording = read_from(bytes, name, layout)?;
    add_labels(&mut recording, None);
    Ok(recording)
}

/// Names and lengths of the cars of a processed platoon.
fn add_labels(recording: &mut Recording, labels: Option<&Labels>) {
    if recording.layout != Layout::AstazeroProcessed {
        return;
    }
    let stem = recording.stem().to_owned();
    for platoon in &mut recording.platoons {
        labels::name_cars(platoon, &stem, labels);
    }
    recording.companions.extend(labels.map(|l| l.source.clone()));
}

/// Reads measured trajectories from a stream, line by line; `name` stands for the file in messages. No companion files
/// are read, and cars of the processed layout keep the names `car 1`, `car 2`, ...
pub fn read_from(input: impl Read, name: &str, layout: Option<Layout>) -> Result<Recording, ImportError> {
    let mut problems = Problems::default();
    let mut lines = Lines::new(input);
    let result = platoons(&mut lines, layout, &mut problems);
    let (layout, platoons) = problems.finish(name, result)?;
    Ok(Recording {
        source: Source { path: name.to_owned(), sha256: lines.sha256() },
        layout,
        platoons,
        companions: Vec::new(),
        grade: None,
        chosen_by: ChosenBy::Place,
    })
}

fn platoons<R: Read>(
    lines: &mut Lines<R>,
    layout: Option<Layout>,
    problems: &mut Problems,
) -> Result<(Layout, Vec<super::Platoon>), Stop> {
    let mut notes = Vec::new();
    let Some(first) = preamble::header(lines, problems, &mut notes, layout::named)? else {
        return Err(problems.stop(1, None, ProblemKind::Empty));
    };
    let line = lines.number();
    let mut fields = Vec::new();
    split(&first, &mut fields);
    // Metadata before the header prevent the use of a column map.
    let bare = !first.to_ascii_lowercase().starts_with("date");
    header::check_separator(&first, line, bare.then_some(&mut *lines), problems)?;
    header::check_names(&fields, problems)?;
    let Some(chosen) = layout.or_else(|| layout::detect(&first)) else {
        let header = Header::parse(&first, line, problems)?;
        let found = header.names;
        return Err(problems.stop(line, None, ProblemKind::UnknownHeader { found }));
    };
    let Some(map) = chosen.map() else {
        return Err(problems.stop(1, None, ProblemKind::NeedsMap));
    };
    let has_metadata = matches!(chosen, Layout::OpenAcc | Layout::AstazeroRebuilt);
    let (names, header) = match has_metadata {
        true => metadata::read(first, lines, problems)?,
        false => (Vec::new(), Header::parse(&first, line, problems)?),
    };
    let found = if has_metadata { metadata::layout(&header) } else { chosen };
    let mut platoons = columns::read_layout(lines, header, (chosen, map), notes, problems)?;
    platoons.iter_mut().for_each(|platoon| metadata::name_cars(platoon, &names));
    Ok((layout.unwrap_or(found), platoons))
}

/// The text of a file: unchanged, unpacked if it is packed by gzip, or the rows of a Parquet table.
pub(super) fn open(path: &Path) -> Result<Box<dyn Read>, ImportError> {
    Ok(opened(path)?.0)
}

/// The same, and whether it is a Parquet table, whose text always has the same form.
fn opened(path: &Path) -> Result<(Box<dyn Read>, bool), ImportError> {
    let shown = || path.display().to_string();
    if path.is_dir() {
        return Err(ImportError::Folder { path: shown() });
    }
    let failed = |source| ImportError::Open { path: shown(), source };
    let mut file = BufReader::new(File::open(path).map_err(failed)?);
    let start = file.fill_buf().map_err(failed)?;
    if start.starts_with(&GZIP) {
        return Ok((Box::new(MultiGzDecoder::new(file)), false));
    }
    if start.starts_with(&parquet::MAGIC) {
        return Ok((Box::new(parquet::Text::of(file.into_inner(), &shown())?), true));
    }
    Ok((Box::new(file), false))
}

/// First bytes of a gzip file.
const GZIP: [u8; 2] = [0x1F, 0x8B];

/// Words of a column that says who drives, besides names: that of a human, and that of a controller.
const DRIVERS: [(&str, &[&str]); 2] =
    [("Human", &["0", "false", "off", "human", "manual"]), ("ACC", &["1", "true", "on", "acc", "auto", "automated"])];

/// Who drives a car by the words of a column, and from when on; an empty field says nothing.
fn driver_modes<'a>(car: usize, words: impl Iterator<Item = (f64, &'a str)>) -> Vec<Note> {
    let mut modes: Vec<Note> = Vec::new();
    for (t_s, word) in words.filter(|(_, word)| !word.is_empty()) {
        let known = DRIVERS.iter().find(|(_, words)| words.iter().any(|known| known.eq_ignore_ascii_case(word)));
        let new = known.map_or(word, |(mode, _)| mode);
        if !matches!(modes.last(), Some(Note::DriverMode { mode, .. }) if mode == new) {
            modes.push(Note::DriverMode { car, t_s, mode: new.to_owned() });
        }
    }
    modes
}

/// Median of the finite values.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    upper_median(values.filter(|value| value.is_finite()))
}
