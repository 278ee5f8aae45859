//! Every pair of a data set, calibrated separately.

use super::calibration::Calibration;
use super::drive::Drive;
use super::error::{Error, Usage, refuse};
use super::loading::{Input, cut_off};
use super::reading::Reading;
use crate::batch::Journal;
use crate::calibrate::{BoundsError, SearchSpace};
use crate::catalog::Variant;
use crate::fleet::{self, Held, Model, Pair, Settings};
use crate::score::GoodnessOfFit;
use crate::study::fingerprint;
use crate::study::table::Table;
use crate::text::option::{HOLDOUT, MODEL, in_file};
use crate::trajectory::PrepareError;
use crate::trajectory::import::is_companion;
use crate::trajectory::soundness::FindingKind;
use anyhow::Context;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The kind of noise, by its name.
const NOISY: &str = FindingKind::Noisy.into_str();
/// True if one of these kinds of faults makes parameters doubtful. Noise of the acceleration does not; it has a separate warning.
pub(crate) fn are_implausible(kinds: &str) -> bool {
    kinds.split(' ').any(|kind| !kind.is_empty() && kind != NOISY)
}

/// A measure that every kind of fault changes.
const ANY: [GoodnessOfFit; 1] = [GoodnessOfFit::NRMSE_SVA];

/// Doubtful pairs that are named.
const DOUBTFUL_NAMED: usize = 20;

/// Limit for the tables of a folder.
const ENDINGS: [&str; 4] = ["csv", "txt", "gz", "parquet"];

/// Leader-follower pairs, of files, of folders or of drives in memory.
#[derive(Debug, Clone, Default)]
pub struct Pairs {
    pub(crate) pairs: Vec<Pair>,
    /// Reasons why files cannot be read, one line each.
    pub(crate) unreadable: Vec<String>,
    /// What files have besides, a line each: pairs that are too short, vehicles without the one ahead.
    pub(crate) left_out: Vec<String>,
    /// Number of pieces of each drive that are left out.
    pieces: Vec<usize>,
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

    /// Drives in memory, one pair each.
    #[must_use]
    pub fn of_drives(drives: &[&Drive]) -> Pairs {
        let pair = |drive: &&Drive| {
            let trajectory = (*drive.trajectory).clone();
            // A model that needs the car looks for it, and reports if it is missing.
            let vehicle = drive.recording.reading.vehicle_of(&trajectory).ok().flatten();
            Pair {
                file: trajectory.source.path.clone(),
                trajectory: trajectory.id.clone(),
                follower: trajectory.follower,
                name: trajectory.name.clone(),
                drive: Ok(fleet::Drive { trajectory, vehicle }),
                is_short: false,
                held: Vec::new(),
            }
        };
        Pairs { pairs: drives.iter().map(pair).collect(), ..Pairs::default() }
    }

    /// Holds back this share of each drive, its end: it is scored but not used for calibration, and decides between models. A drive that is
    /// too short for two parts cannot be calibrated.
    ///
    /// # Errors
    /// When the share is not above 0 and below 1.
    pub fn hold_back(mut self, share: f64) -> Result<Pairs, Error> {
        self.hold(Held::Share(checked_share(share).map_err(anyhow::Error::from)?));
        Ok(self)
    }

    /// Holds these pairs back: each is scored with the parameters of the driver of the same id, and none is calibrated.
    #[must_use]
    pub fn hold_back_pairs(mut self, held: Pairs) -> Pairs {
        self.hold(Held::Pairs(held.pairs));
        self
    }

    /// Returns the number of usable pairs without held-back data.
    pub(crate) fn hold(&mut self, held: Held) -> usize {
        held.hold(&mut self.pairs)
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

    /// Refuses pairs of which none can be used, with the reason of the first.
    #[cfg(feature = "cli")]
    pub(crate) fn check(&self) -> anyhow::Result<()> {
        if self.pairs.iter().any(|pair| pair.drive.is_ok()) {
            return Ok(());
        }
        Err(self
            .none_usable(self.pairs.first().and_then(|pair| Some((pair.place(), pair.drive.as_ref().err()?.clone())))))
    }

    /// The error if no pair can be used; `first` is the place of the first pair and the reason.
    pub(crate) fn none_usable(&self, first: Option<(String, String)>) -> anyhow::Error {
        let reason = match (self.len(), first) {
            (1, Some((place, why))) => format!("the only pair cannot be used: {place}: {why}"),
            (count, Some((place, why))) => format!("none of {count} pairs can be used; the first: {place}: {why}"),
            (_, None) => {
                "found no leader-follower pair; `leadlag inspect FILE` lists the followers of a file".to_owned()
            }
        };
        anyhow::anyhow!("{}", self.unreadable.iter().chain([&reason]).cloned().collect::<Vec<_>>().join("\n"))
    }

    /// Faults of files and signals, one line each.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.unreadable.iter().cloned().chain(self.besides()).chain(self.doubtful()).collect()
    }

    /// What files have besides, and repeated pairs, one line each.
    pub(crate) fn besides(&self) -> Vec<String> {
        let cut = cut_off(self.pieces.iter().copied());
        self.left_out.iter().cloned().chain(cut).chain(self.repeated()).collect()
    }

    /// Number of pairs with doubtful data, their names, and the fault of the first.
    pub(crate) fn doubtful(&self) -> Option<String> {
        let doubtful: Vec<&Pair> = self.pairs.iter().filter(|pair| are_implausible(&pair.doubts(&ANY))).collect();
        let first = doubtful.first()?;
        let named: Vec<String> = doubtful
            .iter()
            .take(DOUBTFUL_NAMED)
            .map(|pair| format!("{} ({})", pair.place(), pair.doubts(&ANY)))
            .collect();
        let more = match doubtful.len().saturating_sub(DOUBTFUL_NAMED) {
            0 => String::new(),
            more => format!(" and {more} more (column `findings` of the table)"),
        };
        let shown = first
            .drive
            .as_ref()
            .ok()
            .and_then(|drive| drive.trajectory.faults_of(|kind| kind != FindingKind::Noisy).next())
            .unwrap_or_default();
        Some(format!(
            "{} of {} pairs have implausible signals: {}{more}; the first: {shown}",
            doubtful.len(),
            self.pairs.len(),
            named.join(", ")
        ))
    }

    /// Number of repeated pairs, and the first of them: each counts in medians and shares.
    fn repeated(&self) -> Option<String> {
        let (mut seen, mut again) = (HashMap::new(), Vec::new());
        for pair in &self.pairs {
            let Ok(fleet::Drive { trajectory, .. }) = &pair.drive else { continue };
            if let Some(first) = seen.insert(fingerprint(trajectory, None), pair) {
                again.push((first, pair));
            }
        }
        let (first, pair) = again.first()?;
        let (count, all) = (again.len(), self.pairs.len());
        let (pair, first) = (pair.place(), first.place());
        let of = if pair == first { "is given twice".to_owned() } else { format!("is {first}") };
        Some(format!(
            "{count} of {all} pairs are copies of another one, and count twice in medians and shares; the first: {pair} {of}"
        ))
    }

    /// The pairs of files; `vehicle`: a model that needs the follower's car, if there is one.
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
            anyhow::ensure!(!stop(), "interrupted while reading the files");
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
        let (found, left_out) = reading.pairs(input, follower, vehicle)?;
        self.left_out.extend(left_out);
        self.pieces.extend(found.iter().map(|one| one.pieces));
        for one in found {
            let is_short = one.drive.as_ref().is_err_and(|error| {
                matches!(error.downcast_ref(), Some(PrepareError::TooShort { .. } | PrepareError::Short { .. }))
            });
            let drive = match one.drive {
                Ok(l) => Ok(fleet::Drive { trajectory: l.trajectory, vehicle: l.vehicle.map(|(vehicle, _)| vehicle) }),
                Err(error) => Err(in_file(|| format!("{error:#}"))),
            };
            self.pairs.push(Pair {
                file: file.clone(),
                trajectory: one.id,
                follower: one.follower,
                name: one.name,
                drive,
                is_short,
                held: Vec::new(),
            });
        }
        Ok(())
    }
}

/// What a command holds back.
pub(crate) enum HeldBack {
    /// This share of each drive, its end.
    Share(f64),
    /// The drives of these files.
    Files(Vec<PathBuf>),
}

impl HeldBack {
    /// As it is given: nothing, one share, or files and folders, none of which is calibrated on.
    pub(crate) fn of(given: &[String], calibrated: &[PathBuf]) -> anyhow::Result<Option<HeldBack>> {
        match given {
            [] => Ok(None),
            given if given.iter().any(|text| text.parse::<f64>().is_ok()) => {
                let [text] = given else {
                    refuse!("{HOLDOUT} {}: expected one share, or files", given.join(" "));
                };
                Ok(Some(HeldBack::Share(checked_share(text.parse()?)?)))
            }
            given => {
                let held = files(given)?;
                if let Some(twice) = held.iter().find(|path| calibrated.contains(path)) {
                    let shown = twice.display();
                    refuse!("{HOLDOUT} {shown}: it is also used for calibration; give another file, or a share");
                }
                Ok(Some(HeldBack::Files(held)))
            }
        }
    }
}

/// A share that can be held back.
pub(crate) fn checked_share(share: f64) -> Result<f64, Usage> {
    if share > 0.0 && share < 1.0 {
        return Ok(share);
    }
    refuse!("{HOLDOUT} {share}: expected a share above 0 and below 1, such as 0.3, or a file or folder of drives");
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

/// Separate calibrations of many pairs with one or several models.
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
    /// For an unknown model, no model, or a repeated one.
    pub fn of(models: &[&str]) -> Result<Fleet, Error> {
        Fleet::of_calibrations(models.iter().map(|model| Calibration::of(model)).collect::<Result<Vec<_>, _>>()?)
    }

    /// The same with a calibration for each model. Seed, measure, convention and evaluator are those of the first one.
    ///
    /// # Errors
    /// When none is given, or one model twice.
    pub fn of_calibrations(calibrations: Vec<Calibration>) -> Result<Fleet, Error> {
        if calibrations.is_empty() {
            refuse!("no model is given");
        }
        distinct(&calibrations).map_err(anyhow::Error::from)?;
        Ok(Fleet { calibrations })
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
    /// For invalid bounds, or if the evaluator fails. A pair that cannot be calibrated is a row with a reason.
    pub fn run(&self, pairs: &Pairs) -> Result<Table, Error> {
        self.run_on(pairs, &|| false, &|_, _| {})
    }

    /// The same; once `stop` is true, the finished rows are the table. `tell` receives the numbers of finished rows and of all, from time to time.
    ///
    /// # Errors
    /// As [`Fleet::run`].
    pub fn run_on(
        &self,
        pairs: &Pairs,
        stop: &(dyn Fn() -> bool + Sync),
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Table, Error> {
        let settings = settings(&self.calibrations, vec![self.first().gof])?;
        let whole = settings.places(pairs.len()).count();
        let rows = fleet::run(
            &pairs.pairs,
            &settings,
            Journal::none(),
            stop,
            &mut |done| tell(done, whole),
            self.first().warn,
        )
        .map_err(anyhow::Error::from)?;
        let rows: Vec<fleet::Row> = rows.into_iter().flatten().collect();
        let comparison = fleet::compare(&pairs.pairs, &settings, &rows).map_err(anyhow::Error::from)?;
        Ok(fleet::table(&pairs.pairs, &settings, &rows, &comparison))
    }

    fn first(&self) -> &Calibration {
        &self.calibrations[0]
    }
}

/// Refuses models that one table could not distinguish.
fn distinct(calibrations: &[Calibration]) -> Result<(), Usage> {
    for (k, Calibration { model, .. }) in calibrations.iter().enumerate() {
        let others = || calibrations[..k].iter().map(|one| &one.model);
        if others().any(|other| other == model) {
            refuse!("{MODEL} {model} is given twice");
        }
        let Some(law) = model.law() else { continue };
        if others().filter_map(Variant::law).any(|other| other.name == law.name && other != law) {
            let name = &law.name;
            refuse!("two laws have the name {name}; rename one of the files");
        }
    }
    Ok(())
}

/// Settings of all pairs: the model of each calibration; everything else, such as seed and convention, of the first one.
pub(crate) fn settings(calibrations: &[Calibration], measures: Vec<GoodnessOfFit>) -> anyhow::Result<Settings> {
    distinct(calibrations)?;
    let Calibration { convention, search, evaluations, intervals, selection, .. } = &calibrations[0];
    let model = |one: &Calibration| {
        one.check_numbers()?;
        let (variant, overrides) = (one.model, one.overrides()?);
        // Bounds that are invalid for every pair are reported once; for a pair without a car, the model reports what it lacks.
        match SearchSpace::new(&variant, None, *convention, &overrides) {
            Err(error @ BoundsError::Impossible { .. }) => Err(error.into()),
            _ => Ok(Model { variant, overrides }),
        }
    };
    let settings = Settings {
        models: calibrations.iter().map(model).collect::<anyhow::Result<_>>()?,
        measures,
        convention: *convention,
        calibration: *search,
        max_evaluations: *evaluations,
        intervals: *intervals,
        selection: selection.clone(),
    };
    fleet::clash(&settings).map_or(Ok(settings), |reason| Err(Usage(reason).into()))
}
