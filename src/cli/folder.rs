//! Folders of results: each holds one complete result, and no file of another one under the same names.

use super::Usage;
use super::change::{Change, settle};
use super::evaluator::printed_warnings;
use crate::api::error::refuse;
use crate::report::html::{MadeBy, RUN_VERSION};
use crate::result::read_bounded;
use anyhow::Context;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Files that mark a calibration, a diagnosis and a fleet.
pub const RESULT: &str = "result.json";
pub const DIAGNOSIS: &str = "diagnosis.json";
pub const FLEET: &str = "fleet.json";
/// The command that made them, and its warnings. It differs from run to run; results do not.
pub const RUN: &str = "run.json";

/// The contents of a file of a result, such as `a fleet`.
pub fn read<T: DeserializeOwned>(path: &Path, what: &str) -> anyhow::Result<T> {
    parsed(&read_bounded(path)?, path, what)
}

/// The same of its text.
pub fn parsed<T: DeserializeOwned>(text: &str, path: &Path, what: &str) -> anyhow::Result<T> {
    serde_json::from_str(text)
        .with_context(|| format!("{}: expected {what} of this version of leadlag", path.display()))
}

/// The result of a calibration, by its file or by the folder of `calibrate`.
pub fn result_file(given: &Path) -> anyhow::Result<PathBuf> {
    let file = if given.is_dir() { given.join(RESULT) } else { given.to_owned() };
    file.parent().map_or(Ok(()), settle)?;
    Ok(file)
}

/// Refuses a folder that holds a result of another kind, some of whose files would be overwritten; `own` is a name for a folder in it.
pub fn refuse(folder: &Path, other: &str, own: &str) -> anyhow::Result<()> {
    settle(folder)?;
    if !folder.join(other).exists() {
        return Ok(());
    }
    let kind = match other {
        RESULT => "calibration",
        FLEET => "fleet",
        _ => "diagnosis",
    };
    let (shown, instead) = (folder.display(), folder.join(own));
    refuse!(
        "--out {shown}: the folder holds the {other} of a {kind}, and its files would mix with those of another result; expected \
         another folder, such as --out {}",
        instead.display()
    );
}

/// Refuses a folder in which a result would replace one of its own input files; `is_own` recognises the names of the result's files.
pub fn spare<'a>(
    folder: &Path,
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    is_own: impl Fn(&str) -> bool,
) -> Result<(), Usage> {
    // A missing folder or file cannot be the same as the other.
    let Ok(here) = folder.canonicalize() else { return Ok(()) };
    let replaced = inputs.into_iter().filter_map(|input| input.canonicalize().ok()).find(|input| {
        let name = input.file_name().and_then(|name| name.to_str());
        input.parent() == Some(&here) && name.is_some_and(&is_own)
    });
    match replaced {
        None => Ok(()),
        Some(input) => refuse!(
            "--out {}: a file of the result would replace the input {}; expected another folder",
            folder.display(),
            input.display()
        ),
    }
}

/// An id as a part of the name of a file or folder.
pub fn part(id: &str) -> String {
    id.chars().map(|c| if c.is_ascii_alphanumeric() || "-._".contains(c) { c } else { '_' }).collect()
}

/// The files of the calibration in a folder, by its trajectories; none without a result.
pub fn of_calibration(folder: &Path) -> Vec<String> {
    let count = counted(&folder.join(RESULT), "data");
    let suffixes = (0..count).map(|i| suffix(i, count));
    suffixes.flat_map(|suffix| [format!("simulation{suffix}.csv"), format!("plot{suffix}.svg")]).collect()
}

/// The end of the names of the files of one drive, counted from 0, of several.
pub fn suffix(number: usize, of: usize) -> String {
    if of == 1 { String::new() } else { format!("_{}", number + 1) }
}

/// The picture of the models that were tried.
pub const RACE: &str = "race.svg";
/// The bounds of the recommended model.
pub const RECOMMENDED_BOUNDS: &str = "bounds.toml";

/// The file of a diagnosis, if a given result is one: its folder, or the file itself.
pub fn diagnosis_file(given: &Path) -> Option<PathBuf> {
    if given.file_name().is_some_and(|name| name == DIAGNOSIS) {
        return Some(given.to_owned());
    }
    Some(given.join(DIAGNOSIS)).filter(|file| file.is_file() && !given.join(RESULT).exists())
}

/// The tables and pictures of the diagnosis in a folder; none without one.
pub fn of_diagnosis(folder: &Path) -> Vec<String> {
    let count = counted(&folder.join(DIAGNOSIS), "drives");
    let of_drive = |i: usize| {
        [format!("simulation_{i}.csv"), format!("simulation_{i}.svg"), format!("missing_acceleration_{i}.csv")]
    };
    let whole =
        ["missing_acceleration.svg", RACE, RECOMMENDED_BOUNDS].map(str::to_owned).into_iter().filter(|_| count > 0);
    (1..=count).flat_map(of_drive).chain(whole).collect()
}

/// Number of entries of a list in a JSON file; 0 without the list.
fn counted(path: &Path, list: &str) -> usize {
    let text = crate::text::bounded::read_to_string(path, crate::text::bounded::RESULT_MAX).unwrap_or_default();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    json[list].as_array().map_or(0, Vec::len)
}

/// Finishes the change of a folder: removes the files of an earlier result, `before`, that the new one lacks, with a message.
pub fn finish(mut change: Change, folder: &Path, mut before: Vec<String>) -> anyhow::Result<()> {
    match super::given() {
        Some(command) => {
            let made = MadeBy { schema_version: RUN_VERSION, command, warnings: printed_warnings() };
            change.write(RUN, (serde_json::to_string_pretty(&made)? + "\n").as_bytes())?;
        }
        // The library has none, and the one from an earlier command does not belong to this result.
        None => before.push(RUN.to_owned()),
    }
    let stale = change.finish(before)?;
    if !stale.is_empty() {
        let (shown, names) = (folder.display(), stale.join(", "));
        eprintln!("removed from {shown} files of an earlier result: {names}");
    }
    Ok(())
}

/// True for `STEM.ENDING` and for `STEM_N.ENDING` with a whole number N.
pub fn is_of(name: &str, stem: &str, ending: &str) -> bool {
    let middle = name.strip_prefix(stem).and_then(|rest| rest.strip_suffix(ending)?.strip_suffix('.'));
    let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    middle.is_some_and(|middle| middle.is_empty() || middle.strip_prefix('_').is_some_and(is_number))
}
