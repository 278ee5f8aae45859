//! State of a study: complete, missing, duplicate, damaged and foreign parts.

use super::folder::Folder;
use super::part::{CalibrationRow, Part};
use super::{StudyError, Task};
use crate::text::bounded::{self, RESULT_MAX};
use crate::whole::TEMPORARY;
use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The parts of a study.
#[derive(Debug, Default)]
pub struct Inventory {
    /// Per task, in its order: the complete part, if any.
    pub parts: Vec<Option<Part>>,
    /// Tasks without a complete part, by index.
    pub missing: Vec<usize>,
    /// Files that are not complete parts: torn, changed, of another version.
    pub damaged: Vec<PathBuf>,
    /// Files that repeat another one byte for byte.
    pub double: Vec<PathBuf>,
    /// Files that contradict another part of the same task, with the file of that one.
    pub conflicting: Vec<(PathBuf, PathBuf)>,
    /// Complete parts of tasks that are not in the plan.
    pub foreign: Vec<PathBuf>,
    /// Temporary files that a process has left behind, or is writing right now.
    pub unfinished: Vec<PathBuf>,
}

impl Inventory {
    /// Number of tasks with a part.
    pub fn done(&self) -> usize {
        self.parts.len() - self.missing.len()
    }

    /// The best replicate of each goodness of fit, variant and trajectory, in the order of the tasks; of equal ones the first.
    pub fn winners(&self) -> Vec<&Part> {
        fn key(part: &Part) -> (&str, &str, &str, usize) {
            let CalibrationRow { gof, variant, platoon, follower, .. } = &part.calibration;
            (gof, variant, platoon, *follower)
        }
        let mut best: HashMap<_, (f64, &str)> = HashMap::new();
        for part in self.parts.iter().flatten() {
            let Some(score) = part.calibration.score else { continue };
            let place = best.entry(key(part)).or_insert((score, &part.id));
            if score < place.0 {
                *place = (score, &part.id);
            }
        }
        let has_won = |part: &&Part| best.get(&key(part)).is_some_and(|(_, id)| part.id == *id);
        self.parts.iter().flatten().filter(has_won).collect()
    }

    /// Number of calibrations without a result.
    pub fn failed(&self) -> usize {
        self.parts.iter().flatten().filter(|part| !part.calibration.success).count()
    }
}

/// Looks through `parts/` of the study, and through further folders of parts. Every file counts, whatever its name; those that have the name of their
/// task come first. Fails when a folder cannot be read.
pub fn look(folder: &Folder, tasks: &[Task], further: &[PathBuf]) -> Result<Inventory, StudyError> {
    let index: HashMap<&str, usize> = tasks.iter().enumerate().map(|(i, task)| (task.id.as_str(), i)).collect();
    let mut inventory = Inventory { parts: tasks.iter().map(|_| None).collect(), ..Inventory::default() };
    let mut files: Vec<PathBuf> = vec![PathBuf::new(); tasks.len()];
    let own = folder.parts();
    for parts in std::iter::once(&own).chain(further) {
        let mut paths = sorted(parts)?;
        paths.sort_by_key(|path| !path.file_stem().and_then(|id| id.to_str()).is_some_and(|id| index.contains_key(id)));
        for path in paths {
            let of = |ending: &str| path.extension().is_some_and(|e| e == ending);
            if of(TEMPORARY) {
                inventory.unfinished.push(path);
                continue;
            }
            let bytes = match bounded::read(&path, RESULT_MAX) {
                // No part is larger.
                Err(error) if error.kind() == ErrorKind::FileTooLarge => Vec::new(),
                read => read.map_err(StudyError::file(&path, "read the part"))?,
            };
            let Some(part) = Part::decode(&bytes) else {
                inventory.damaged.push(path);
                continue;
            };
            let Some(&i) = index.get(part.id.as_str()) else {
                inventory.foreign.push(path);
                continue;
            };
            match &mut inventory.parts[i] {
                place @ None => (*place, files[i]) = (Some(part), path),
                Some(other) if *other == part => inventory.double.push(path),
                Some(_) => inventory.conflicting.push((path, files[i].clone())),
            }
        }
    }
    inventory.missing = (0..tasks.len()).filter(|&i| inventory.parts[i].is_none()).collect();
    Ok(inventory)
}

/// The files of a folder, by name: the first fault found must not depend on the file system.
fn sorted(folder: &Path) -> Result<Vec<PathBuf>, StudyError> {
    let entries = std::fs::read_dir(folder).map_err(StudyError::file(folder, "read the parts"))?;
    let mut paths = Vec::new();
    for entry in entries {
        let path = entry.map_err(StudyError::file(folder, "read the parts"))?.path();
        if path.is_file() {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}
