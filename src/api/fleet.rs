//! Every pair of a data set, calibrated by itself.

use super::calibration::Calibration;
use super::drive::Drive;
use super::error::{Error, Usage};
use super::reading::{Input, Reading};
use crate::catalog::Variant;
use crate::fleet::{self, Journal, Model, Pair, Settings};
use crate::study::table::Table;
use crate::trajectory::import::is_companion;
use anyhow::Context;
use std::path::{Path, PathBuf};

/// What a folder may hold of tables.
const ENDINGS: [&str; 4] = ["csv", "txt", "gz", "parquet"];

/// Leader-follower pairs, of files, of folders or of drives at hand.
#[derive(Debug, Clone, Default)]
pub struct Pairs {
    pub(crate) pairs: Vec<Pair>,
    /// Why files cannot be read, a line each.
    pub(crate) unreadable: Vec<String>,
    /// What is implausible in pairs, the first of each.
    pub(crate) doubts: Vec<String>,
}

impl Pairs {
    /// Every pair of files, and of the tables in folders. A pair that cannot be used is kept with the reason.
    ///
    /// # Errors
    /// When a folder cannot be listed, or the only file cannot be read.
    pub fn read<P: AsRef<Path>>(reading: &Reading, paths: &[P]) -> Result<Pairs, Error> {
        let files = files(paths)?;
        Ok(Pairs::of_files(reading, &files, None, None, &|| false)?)
    }

    /// Every pair of the text of a table; `name` stands for the file.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn of_text(reading: &Reading, text: &[u8], name: &str) -> Result<Pairs, Error> {
        let mut pairs = Pairs::default();
        pairs.take(reading, Input::Text(text, name), None, None)?;
        Ok(pairs)
    }

    /// Drives at hand, a pair each.
    #[must_use]
    pub fn of_drives(drives: &[&Drive]) -> Pairs {
        let pair = |drive: &&Drive| {
            let trajectory = (*drive.trajectory).clone();
            // The car is looked for where a model needs it, and its absence is told there.
            let vehicle = drive.recording.reading.vehicle_of(&trajectory).ok().flatten();
            Pair {
                file: trajectory.source.path.clone(),
                trajectory: trajectory.id.clone(),
                follower: trajectory.follower,
                name: trajectory.name.clone(),
                drive: Ok(fleet::Drive { trajectory, vehicle }),
            }
        };
        Pairs { pairs: drives.iter().map(pair).collect(), ..Pairs::default() }
    }

    /// Number of pairs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// True without pairs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// What is wrong with files and signals, a line each.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.unreadable.iter().cloned().chain(self.doubtful()).collect()
    }

    /// How many pairs have implausible signals, and what of the first.
    pub(crate) fn doubtful(&self) -> Option<String> {
        let first = self.doubts.first()?;
        let (doubtful, all) = (self.doubts.len(), self.pairs.len());
        Some(format!("{doubtful} of {all} pairs have implausible signals; the first: {first}"))
    }

    /// The pairs of files; `vehicle`: a model that needs the follower's car, if any does.
    pub(crate) fn of_files(
        reading: &Reading,
        files: &[PathBuf],
        follower: Option<&str>,
        vehicle: Option<&Variant>,
        stop: &dyn Fn() -> bool,
    ) -> anyhow::Result<Pairs> {
        let mut pairs = Pairs::default();
        for path in files {
            match pairs.take(reading, Input::File(path), follower, vehicle) {
                Ok(()) => {}
                Err(error) if files.len() == 1 => return Err(error),
                Err(error) => pairs.unreadable.push(format!("{error:#}")),
            }
            anyhow::ensure!(!stop(), "interrupted while reading; nothing was calibrated");
        }
        Ok(pairs)
    }

    fn take(
        &mut self,
        reading: &Reading,
        input: Input<'_>,
        follower: Option<&str>,
        vehicle: Option<&Variant>,
    ) -> anyhow::Result<()> {
        let file = input.shown();
        for one in reading.pairs(input, follower, vehicle)? {
            let named = one.id.as_ref().map_or(String::new(), |id| format!(" trajectory {id}"));
            self.doubts.extend(one.doubts.first().map(|doubt| format!("{file}{named}: {doubt}")));
            let drive = match one.drive {
                Ok(l) => Ok(fleet::Drive { trajectory: l.trajectory, vehicle: l.vehicle.map(|(vehicle, _)| vehicle) }),
                Err(error) => Err(format!("{error:#}")),
            };
            self.pairs.push(Pair {
                file: file.clone(),
                trajectory: one.id,
                follower: one.follower,
                name: one.name,
                drive,
            });
        }
        Ok(())
    }
}

/// The files, with the tables of folders in the order of their names.
pub(crate) fn files<P: AsRef<Path>>(given: &[P]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in given.iter().map(AsRef::as_ref) {
        if !path.is_dir() {
            files.push(path.to_owned());
            continue;
        }
        let shown = path.display();
        let entries = std::fs::read_dir(path).with_context(|| format!("{shown}: cannot list the folder"))?;
        let is_table = |path: &PathBuf| {
            let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
            path.is_file() && !is_companion(path) && ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str()))
        };
        let mut inside: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_table).collect();
        inside.sort();
        anyhow::ensure!(
            !inside.is_empty(),
            "{shown}: the folder has no tables ({})",
            ENDINGS.map(|e| format!(".{e}")).join(", ")
        );
        files.append(&mut inside);
    }
    Ok(files)
}

/// Calibrations of many pairs, each by itself, with one or several models.
///
/// ```no_run
/// use leadlag::{Fleet, Pairs, Reading};
///
/// let pairs = Pairs::read(&Reading::default(), &["pairs.csv"])?;
/// let table = Fleet::of(&["idm", "gipps+delay"])?.each(|calibration| calibration.bounds("human")).run(&pairs)?;
/// # Ok::<(), leadlag::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Fleet {
    calibrations: Vec<Calibration>,
}

impl Fleet {
    /// Calibrations with these models, by name or id.
    ///
    /// # Errors
    /// When there is no such model, or none is given, or one twice.
    pub fn of(models: &[&str]) -> Result<Fleet, Error> {
        Fleet::of_calibrations(models.iter().map(|model| Calibration::of(model)).collect::<Result<Vec<_>, _>>()?)
    }

    /// The same of calibrations, a model each. Seed, measure, convention and evaluator are those of the first one.
    ///
    /// # Errors
    /// When none is given, or one model twice.
    pub fn of_calibrations(calibrations: Vec<Calibration>) -> Result<Fleet, Error> {
        let twice = |k: &usize| calibrations[..*k].iter().any(|other| other.model == calibrations[*k].model);
        let wrong = match (calibrations.is_empty(), (0..calibrations.len()).find(twice)) {
            (true, _) => "no model is given".to_owned(),
            (_, Some(k)) => format!("--model {} is given twice", calibrations[k].model),
            _ => return Ok(Fleet { calibrations }),
        };
        Err(anyhow::Error::from(Usage(wrong)).into())
    }

    /// Changes the settings of every calibration. Seed, measure, convention and evaluator are those of the first one.
    #[must_use]
    pub fn each(mut self, change: impl FnMut(Calibration) -> Calibration) -> Fleet {
        self.calibrations = self.calibrations.into_iter().map(change).collect();
        self
    }

    /// Calibrates every pair: a row per pair and model, with units in the names of the columns.
    ///
    /// # Errors
    /// When a bound cannot be or the evaluator fails. A pair that cannot be calibrated is a row with a reason.
    pub fn run(&self, pairs: &Pairs) -> Result<Table, Error> {
        self.run_on(pairs, &|| false, &|_, _| {})
    }

    /// The same; once `stop` is true, the rows that are there are the table. `tell` is given how many rows are there and how many there will be, from any thread.
    ///
    /// # Errors
    /// As [`Fleet::run`].
    pub fn run_on(
        &self,
        pairs: &Pairs,
        stop: &(dyn Fn() -> bool + Sync),
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Table, Error> {
        let settings = self.settings()?;
        let whole = settings.places(pairs.len()).count();
        let rows =
            fleet::run(&pairs.pairs, &settings, &Journal::none(), stop, &|done| tell(done, whole), self.first().warn)
                .map_err(anyhow::Error::from)?;
        let rows: Vec<fleet::Row> = rows.into_iter().flatten().collect();
        Ok(fleet::table(&pairs.pairs, &settings, &rows))
    }

    fn first(&self) -> &Calibration {
        &self.calibrations[0]
    }

    fn settings(&self) -> anyhow::Result<Settings> {
        let Calibration { gof, convention, search, evaluations, intervals, selection, .. } = self.first();
        let model = |one: &Calibration| {
            one.check_numbers()?;
            Ok(Model { variant: one.model, overrides: one.overrides()? })
        };
        Ok(Settings {
            models: self.calibrations.iter().map(model).collect::<anyhow::Result<_>>()?,
            measures: vec![*gof],
            convention: *convention,
            calibration: *search,
            max_evaluations: *evaluations,
            intervals: *intervals,
            selection: selection.clone(),
        })
    }
}
