//! Studies: many calibrations laid out in a folder, which any number of processes may compute.

use super::error::Error;
use super::model::{BY_PLAN, transcribed};
use crate::evaluator::AdapterChoice;
use crate::study::table::Table;
use crate::study::{Assignment, Event, Progress, RunSettings, Study as Planned, StudyError, Task};
use crate::study::{chosen, folder::Folder, inventory, merge, run};
use crate::text::bounded;
use std::path::Path;
use std::sync::atomic::Ordering;

/// A study: data x models x measures x replicates, as a plan says, in a folder that keeps what is done.
///
/// ```no_run
/// let study = leadlag::Study::create("plan.toml", "study")?;
/// study.run(&|| false, &mut |done, all| eprintln!("{done} of {all}"))?;
/// let [calibrations, validations] = study.merged()?;
/// println!("{} calibrations, {} validation runs", calibrations.rows(), validations.rows());
/// # Ok::<(), leadlag::Error>(())
/// ```
#[derive(Debug)]
pub struct Study(Folder);

impl Study {
    /// Lays out the study of a plan in a folder; finished tasks there stay.
    ///
    /// # Errors
    /// When the plan cannot be carried out, its data cannot be read, or the folder holds another study.
    pub fn create(plan: impl AsRef<Path>, folder: impl AsRef<Path>) -> Result<Study, Error> {
        Study::create_with(plan, folder, None)
    }

    /// The same with another data folder than that of the plan.
    ///
    /// # Errors
    /// As [`Study::create`].
    pub fn create_with(plan: impl AsRef<Path>, folder: impl AsRef<Path>, data: Option<&Path>) -> Result<Study, Error> {
        let (study, content, _) = planned(plan.as_ref(), data)?;
        Folder::create(folder.as_ref(), &content, &study).map(Study).map_err(failed)
    }

    /// The study of a folder.
    ///
    /// # Errors
    /// For a missing study.
    pub fn open(folder: impl AsRef<Path>) -> Result<Study, Error> {
        let folder = Folder::open(folder.as_ref()).map_err(failed)?;
        folder.tasks().map_err(failed)?;
        Ok(Study(folder))
    }

    /// The ids of the tasks that are not done, in the order of the plan.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn missing(&self) -> Result<Vec<String>, Error> {
        let tasks = self.0.tasks().map_err(failed)?;
        let inventory = inventory::look(&self.0, &tasks, &[]).map_err(failed)?;
        Ok(inventory.missing.iter().map(|&i| tasks[i].id.clone()).collect())
    }

    /// Computes the remaining tasks on all cores; other processes may do the same. `stop` is polled and ends the run early; finished
    /// tasks are kept. `tell` receives the number of finished tasks and of all tasks.
    ///
    /// # Errors
    /// When the data differ from those of the plan, a part cannot be written, or the evaluator fails.
    pub fn run(&self, stop: &(dyn Fn() -> bool + Sync), tell: &mut dyn FnMut(u64, u64)) -> Result<(), Error> {
        let tasks = self.0.study(None).map_err(failed)?;
        let chosen: Vec<usize> = (0..tasks.1.len()).collect();
        self.run_tasks(&tasks, &chosen, stop, tell)
    }

    /// The same for some tasks, by their ids; `data`: the folder of the data if it has moved.
    ///
    /// # Errors
    /// As [`Study::run`], and for an unknown task.
    pub fn run_some(
        &self,
        ids: &[String],
        data: Option<&Path>,
        stop: &(dyn Fn() -> bool + Sync),
        tell: &mut dyn FnMut(u64, u64),
    ) -> Result<(), Error> {
        let tasks = self.0.study(data).map_err(failed)?;
        let chosen = chosen(ids, &tasks.1).map_err(failed)?;
        self.run_tasks(&tasks, &chosen, stop, tell)
    }

    fn run_tasks(
        &self,
        (study, tasks): &(Planned, Vec<Task>),
        chosen: &[usize],
        stop: &(dyn Fn() -> bool + Sync),
        tell: &mut dyn FnMut(u64, u64),
    ) -> Result<(), Error> {
        let assignment = Assignment { folder: &self.0, study, tasks, chosen };
        let settings = RunSettings { in_flight: None, wait: true, adapter: AdapterChoice::Best, warn: |_| {} };
        let progress = Progress::default();
        let all = chosen.len() as u64;
        let mut heard = |_: Event| tell(progress.done.load(Ordering::SeqCst), all);
        run(assignment, &settings, &progress, stop, &mut heard).map_err(failed)?;
        tell(progress.done.load(Ordering::SeqCst), all);
        Ok(())
    }

    /// The tables of the finished tasks: calibrations and validation runs, with units in the names of the columns.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn merged(&self) -> Result<[Table; 2], Error> {
        let tasks = self.0.tasks().map_err(failed)?;
        let inventory = inventory::look(&self.0, &tasks, &[]).map_err(failed)?;
        let file = self.0.study_file().map_err(failed)?;
        let merged = merge::merge(&file, &tasks, &inventory);
        Ok([merged.calibrations, merged.validations])
    }
}

/// The study of a plan with the data of `data` or else those of the plan, the text of the plan, and whether a study keeps that plan.
pub(crate) fn planned(file: &Path, data: Option<&Path>) -> anyhow::Result<(Planned, String, bool)> {
    let (mut plan, kept) = Folder::plan_of(file)?;
    plan.calibration.variants.iter().try_for_each(|v| transcribed(plan.calibration.evaluator, v, BY_PLAN))?;
    if let Some(folder) = data {
        folder.clone_into(&mut plan.data.folder);
    }
    let content = bounded::read_to_string(file, bounded::TEXT_MAX)?;
    Ok((Planned::open(plan)?, content, kept))
}

fn failed(error: StudyError) -> Error {
    anyhow::Error::from(error).into()
}
