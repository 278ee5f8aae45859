//! Folders of results: each holds one result, whole, and no file of another one under the same names.

use super::{Usage, output};
use std::path::Path;

/// What a calibration and a diagnosis are known by.
pub const RESULT: &str = "result.json";
pub const DIAGNOSIS: &str = "diagnosis.json";

/// Refuses a folder that holds a result of another kind, some of whose files would be overwritten; `own` is a name for a folder in it.
pub fn refuse(folder: &Path, other: &str, own: &str) -> Result<(), Usage> {
    if !folder.join(other).exists() {
        return Ok(());
    }
    let kind = if other == RESULT { "calibration" } else { "diagnosis" };
    let (shown, instead) = (folder.display(), folder.join(own));
    Err(Usage(format!(
        "--out {shown}: the folder holds the {other} of a {kind}, and the files of another result would get mixed with its own; expected \
         a folder for this one, such as --out {}",
        instead.display()
    )))
}

/// Removes what an earlier result left in a folder and the one that was just written has not, and says so.
pub fn tidy(folder: &Path, written: &[String], is_own: impl Fn(&str) -> bool) -> anyhow::Result<()> {
    // A folder that was just written can be listed; what cannot be removed is told by the error of the one who removes it.
    let names = std::fs::read_dir(folder)?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let mut stale: Vec<String> = names.filter(|name| !written.contains(name) && is_own(name)).collect();
    stale.sort();
    for name in &stale {
        output::remove_file(&folder.join(name))?;
    }
    if !stale.is_empty() {
        let (shown, names) = (folder.display(), stale.join(", "));
        eprintln!("removed from {shown} what an earlier result had left there: {names}");
    }
    Ok(())
}

/// True for `STEM_N.ENDING` with a whole number N.
pub fn is_numbered(name: &str, stem: &str, ending: &str) -> bool {
    let number =
        name.strip_prefix(stem).and_then(|rest| rest.strip_prefix('_')?.strip_suffix(ending)?.strip_suffix('.'));
    number.is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()))
}
