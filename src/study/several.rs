//! One entry of a plan for several drives: the files of a pattern, or the trajectories of a table.

use super::error::DriveError;
use super::plan::PlatoonPlan;
use crate::trajectory::Recording;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The files of an entry, in the order of their names: the named one, or those of a pattern with a `*` in the name of the file.
pub(super) fn files(folder: &Path, plan: &PlatoonPlan) -> Result<Vec<PathBuf>, DriveError> {
    let name = plan.file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let Some((begin, end)) = name.split_once('*').filter(|_| plan.is_pattern) else {
        return Ok(vec![plan.file.clone()]);
    };
    let parent = plan.file.parent().unwrap_or(Path::new(""));
    let is_one = |name: &str| name.len() >= begin.len() + end.len() && name.starts_with(begin) && name.ends_with(end);
    let entries = std::fs::read_dir(folder.join(parent)).into_iter().flatten().flatten();
    let mut found: Vec<String> = entries
        .filter(|entry| entry.path().is_file())
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| is_one(name))
        .collect();
    found.sort();
    if found.is_empty() {
        return Err(DriveError::NoFile {
            platoon: plan.name.clone(),
            pattern: folder.join(&plan.file).display().to_string(),
        });
    }
    Ok(found.into_iter().map(|name| parent.join(name)).collect())
}

/// The trajectories of an entry's file, each as a separate entry; the entry itself if it is for one.
pub(super) fn trajectories(
    plan: &PlatoonPlan,
    file: &Path,
    recording: &Recording,
    names: &mut HashSet<String>,
) -> Vec<PlatoonPlan> {
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let ids: Vec<Option<String>> = match plan.all {
        true => recording.platoons.iter().map(|platoon| platoon.id.clone()).collect(),
        false => vec![plan.trajectory.clone()],
    };
    let mut one = |id: Option<String>| {
        let of_file = stem.iter().filter(|_| plan.is_pattern).cloned();
        let of_table = id.iter().filter(|_| plan.all).cloned();
        let parts: Vec<String> = std::iter::once(plan.name.clone()).chain(of_file).chain(of_table).collect();
        let name = plain(&parts.join("-"));
        let numbered = (2..).map(|k| format!("{name}-{k}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|name| !names.contains(name));
        let name = free.expect("one of infinitely many numbers is free");
        names.insert(name.clone());
        PlatoonPlan { name, file: file.to_owned(), trajectory: id, all: false, is_pattern: false, ..plan.clone() }
    };
    ids.into_iter().map(&mut one).collect()
}

/// Letters, digits, `-`, `_` and `.`, as all names of platoons.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}
