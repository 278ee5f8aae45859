//! The folder of a study, and files that are written whole or not at all.
//!
//! ```text
//!  plan.toml     the plan, as it was given
//!  study.json    what it means: settings, trajectories, checksums
//!  tasks.jsonl   one task per line
//!  parts/        one file per finished task
//!  claims/       which tasks are under way; empty files that running processes hold locks on
//!  runs/         what each process has done in which time; not part of any result
//!  merged/       the tables
//!  report/       tables and figures beside the paper's
//! ```

use super::drive::DriveEntry;
use super::plan::StoredExtension;
use super::task::{Study, Task};
use super::{PROGRAM, Plan, SCHEMA_VERSION, StudyError, sha256};
use crate::extension::Extension;
use crate::symbols::Symbol;
use crate::text::bounded::{self, RESULT_MAX, TEXT_MAX};
use crate::trajectory::hexadecimal;
use crate::whole::{self, TEMPORARY};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// The folder of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Folder {
    path: PathBuf,
}

/// `study.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyFile {
    /// Version of the study's files.
    pub schema_version: u32,
    /// The program that planned it.
    pub program: String,
    pub name: String,
    /// The data folder, absolute.
    pub data_folder: PathBuf,
    pub convention: String,
    /// The measure to minimise.
    pub gofs: Vec<String>,
    pub variants: Vec<String>,
    /// Parameters of the variants beyond those of Table 1.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub extensions: Vec<StoredExtension>,
    /// The laws among the base models.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub laws: Vec<StoredExtension>,
    /// Calibrations per trajectory, variant and goodness of fit.
    pub replicates: u64,
    pub seed: u64,
    /// The algorithm.
    pub optimizer: String,
    /// Largest number of simulated candidates of a calibration.
    pub max_evaluations: u64,
    /// SHA-256 of `tasks.jsonl`, which is written after this file.
    pub tasks_sha256: String,
    /// The trajectories.
    pub drives: Vec<DriveEntry>,
}

impl StudyFile {
    /// Parameters of extensions and laws that are not in the paper's table; of those that this program can read.
    pub fn own_parameters(&self) -> Vec<Symbol> {
        let extensions = self.extensions.iter().filter_map(|stored| stored.read().ok().flatten());
        let mut own: Vec<Symbol> = Vec::new();
        for symbol in extensions.chain(self.read_laws()).flat_map(Extension::own_parameters) {
            // Laws may have a parameter of the same name; the plan ensures that it has the same unit.
            if !own.iter().any(|known| known.name() == symbol.name()) {
                own.push(symbol);
            }
        }
        own
    }

    /// The laws among the base models; of those that this program can read.
    pub fn read_laws(&self) -> Vec<&'static Extension> {
        self.laws.iter().filter_map(|stored| stored.read().ok().flatten()).collect()
    }
}

impl Folder {
    /// Lays a study out in a folder: plan, settings and tasks. Existing parts stay. Fails if the folder has another plan, or cannot be written.
    pub fn create(path: &Path, plan: &str, study: &Study) -> Result<Folder, StudyError> {
        let folder = Folder { path: path.to_owned() };
        let copy = path.join("plan.toml");
        let is_study = ["study.json", "tasks.jsonl"].iter().any(|name| path.join(name).exists());
        if !is_study && bounded::read(&copy, TEXT_MAX).is_ok_and(|content| content != plan.as_bytes()) {
            return Err(StudyError::ForeignPlan(copy.display().to_string()));
        }
        folder.make()?;
        let given = &study.plan.data.folder;
        // The path is empty for a plan in the working directory that names no folder.
        let here = if given.as_os_str().is_empty() { Path::new(".") } else { given };
        let data_folder = std::path::absolute(here).map_err(StudyError::file(given, "find the data folder"))?;
        let settings = &study.plan.calibration;
        let line = |task: &Task| serde_json::to_string(task).expect("a task is valid JSON") + "\n";
        let lines: String = study.tasks().iter().map(line).collect();
        let file = StudyFile {
            schema_version: SCHEMA_VERSION,
            program: PROGRAM.clone(),
            name: study.plan.name.clone(),
            data_folder,
            convention: settings.convention.to_string(),
            gofs: settings.gofs.iter().map(ToString::to_string).collect(),
            variants: settings.variants.iter().map(ToString::to_string).collect(),
            extensions: settings.extend.iter().map(StoredExtension::of).collect(),
            laws: settings.laws.iter().map(StoredExtension::of).collect(),
            replicates: settings.replicates,
            seed: settings.seed,
            optimizer: settings.optimizer.runs().to_owned(),
            max_evaluations: settings.stop.max_evaluations,
            tasks_sha256: sha256(lines.as_bytes()),
            drives: study.drives.iter().map(|drive| drive.entry.clone()).collect(),
        };
        write_whole(&copy, plan.as_bytes())?;
        let pretty = serde_json::to_string_pretty(&file).expect("a study is valid JSON") + "\n";
        write_whole(&path.join("study.json"), pretty.as_bytes())?;
        // Written last: without it there is no study, and its checksum reveals a list of another plan.
        write_whole(&path.join("tasks.jsonl"), lines.as_bytes())?;
        Ok(folder)
    }

    /// An existing study.
    pub fn open(path: &Path) -> Result<Folder, StudyError> {
        let shown = path.display().to_string();
        if path.is_file() {
            return Err(StudyError::PlanForFolder(shown));
        }
        if !path.join("tasks.jsonl").is_file() {
            return Err(StudyError::NoStudy(shown));
        }
        Ok(Folder { path: path.to_owned() })
    }

    /// Creates missing folders of parts, claims and runs, because copies of a study lose empty ones. Fails when one cannot be made.
    pub fn make(&self) -> Result<(), StudyError> {
        let folders = [self.parts(), self.claims(), self.runs()];
        folders.iter().try_for_each(|path| fs::create_dir_all(path).map_err(StudyError::file(path, "make the folder")))
    }

    /// The tasks, in the order of all tables.
    pub fn tasks(&self) -> Result<Vec<Task>, StudyError> {
        let path = self.path.join("tasks.jsonl");
        let failed = || StudyError::file(&path, "read the tasks");
        let mut lines = BufReader::new(bounded::Lines::new(File::open(&path).map_err(failed())?));
        let (mut tasks, mut hash, mut line) = (Ok(Vec::new()), Sha256::new(), Vec::new());
        for number in 1.. {
            line.clear();
            if lines.read_until(b'\n', &mut line).map_err(failed())? == 0 {
                break;
            }
            hash.update(&line);
            // If the list does not belong to the plan, neither its tasks nor its faults count.
            if let Ok(read) = &mut tasks {
                match serde_json::from_slice(&line) {
                    Ok(task) => read.push(task),
                    Err(_) => tasks = Err(self.content(&path, number, "one task in JSON")),
                }
            }
        }
        if hexadecimal(&hash.finalize()) != self.study_file()?.tasks_sha256 {
            return Err(StudyError::HalfPlanned(self.path.display().to_string()));
        }
        tasks
    }

    /// The plan, read. Fails when it cannot be read, or is of another version.
    pub fn study_file(&self) -> Result<StudyFile, StudyError> {
        let path = self.path.join("study.json");
        let text = bounded::read_to_string(&path, RESULT_MAX).map_err(StudyError::file(&path, "read the study"))?;
        let file: Option<StudyFile> = serde_json::from_str(&text).ok();
        file.filter(|f| f.schema_version == SCHEMA_VERSION)
            .ok_or_else(|| self.content(&path, 1, "a study.json of this version of the program"))
    }

    /// The plan as given, with the name, the data folder and the extensions in the study. Fails when it is unreadable, or no longer valid.
    pub fn plan(&self) -> Result<Plan, StudyError> {
        let file = self.study_file()?;
        let mut plan = Plan::read_with(&self.path.join("plan.toml"), &[file.extensions, file.laws].concat())?;
        plan.name = file.name;
        plan.data.folder = file.data_folder;
        Ok(plan)
    }

    /// The plan of a file, and whether a study keeps it: then its name, its data folder and its extensions are those of the study.
    pub fn plan_of(file: &Path) -> Result<(Plan, bool), StudyError> {
        let kept = file.parent().filter(|_| file.file_name().is_some_and(|name| name == "plan.toml"));
        let kept = kept.and_then(|folder| Folder::open(folder).ok()).filter(|folder| folder.study_file().is_ok());
        Ok(match kept {
            Some(folder) => (folder.plan()?, true),
            None => (Plan::read(file)?, false),
        })
    }

    /// The plan with its data, read again; they must still give the planned tasks. Fails if the data have changed.
    pub fn study(&self, data: Option<&Path>) -> Result<(Study, Vec<Task>), StudyError> {
        let mut plan = self.plan()?;
        if let Some(data) = data {
            data.clone_into(&mut plan.data.folder);
        }
        let study = Study::open(plan)?;
        let (planned, now) = (self.tasks()?, study.tasks());
        if planned != now {
            let known: std::collections::HashSet<&str> = planned.iter().map(|task| task.id.as_str()).collect();
            let changed = now.iter().filter(|task| !known.contains(task.id.as_str())).count();
            return Err(StudyError::Changed {
                folder: self.path.display().to_string(),
                data: study.plan.data.folder.display().to_string(),
                changed: changed.max(planned.len().saturating_sub(now.len())),
                tasks: now.len(),
                program: PROGRAM.clone(),
            });
        }
        Ok((study, planned))
    }

    fn content(&self, path: &Path, line: usize, expected: &'static str) -> StudyError {
        StudyError::Content { path: path.display().to_string(), line, expected }
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Finished tasks.
    pub fn parts(&self) -> PathBuf {
        self.path.join("parts")
    }

    /// The part of a task.
    pub fn part(&self, id: &str) -> PathBuf {
        self.path.join("parts").join(format!("{id}.json"))
    }

    /// Tasks under way.
    pub fn claims(&self) -> PathBuf {
        self.path.join("claims")
    }

    /// Work of each process.
    pub fn runs(&self) -> PathBuf {
        self.path.join("runs")
    }

    /// The tables.
    pub fn merged(&self) -> PathBuf {
        self.path.join("merged")
    }

    /// Tables and figures beside the paper's.
    pub fn report(&self) -> PathBuf {
        self.path.join("report")
    }

    /// A folder without a study, in which tasks are computed once more.
    pub(super) fn bare(path: &Path) -> Folder {
        Folder { path: path.to_owned() }
    }

    /// Removes files that killed processes left unfinished. These files have no locks, so it removes only those that no process
    /// can still be writing.
    pub fn sweep(&self) {
        let folders = [self.path.clone(), self.parts(), self.runs(), self.merged(), self.report()];
        for entry in folders.iter().flat_map(fs::read_dir).flatten().flatten() {
            let is_temporary = entry.path().extension().is_some_and(|ending| ending == TEMPORARY);
            if is_temporary && entry.metadata().is_ok_and(|file| file.is_file() && whole::is_old(&file)) {
                // Best effort: a leftover does no harm.
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// Writes a file completely, or leaves the old one. Fails when it cannot be written; then nothing of it remains.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<(), StudyError> {
    whole::write(path, content).map_err(StudyError::file(path, "write the file"))
}
