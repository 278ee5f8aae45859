//! Studies: many calibrations laid out in a folder, which any number of processes may compute.

use super::error::{Error, usage};
use crate::evaluator::AdapterChoice;
use crate::study::table::Table;
use crate::study::{Assignment, Event, Plan, Progress, RunSettings, folder::Folder, inventory, merge, run};
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
        let file = plan.as_ref();
        let plan = Plan::read(file).map_err(usage)?;
        let content =
            crate::text::bounded::read_to_string(file, crate::text::bounded::TEXT_MAX).map_err(anyhow::Error::from)?;
        let study = crate::study::Study::open(plan).map_err(anyhow::Error::from)?;
        Folder::create(folder.as_ref(), &content, &study).map(Study).map_err(|error| anyhow::Error::from(error).into())
    }

    /// The study of a folder.
    ///
    /// # Errors
    /// For a missing study.
    pub fn open(folder: impl AsRef<Path>) -> Result<Study, Error> {
        let folder = Folder::open(folder.as_ref()).map_err(anyhow::Error::from)?;
        folder.tasks().map_err(anyhow::Error::from)?;
        Ok(Study(folder))
    }

    /// Computes the remaining tasks on all cores; other processes may do the same. `stop` is polled and ends the run early; finished
    /// tasks are kept. `tell` receives the number of finished tasks and of all tasks.
    ///
    /// # Errors
    /// When the data differ from those of the plan, a part cannot be written, or the evaluator fails.
    pub fn run(&self, stop: &(dyn Fn() -> bool + Sync), tell: &mut dyn FnMut(u64, u64)) -> Result<(), Error> {
        let (study, tasks) = self.0.study(None).map_err(anyhow::Error::from)?;
        let chosen: Vec<usize> = (0..tasks.len()).collect();
        let assignment = Assignment { folder: &self.0, study: &study, tasks: &tasks, chosen: &chosen };
        let settings = RunSettings { in_flight: None, wait: true, adapter: AdapterChoice::Best, warn: |_| {} };
        let progress = Progress::default();
        let all = tasks.len() as u64;
        let mut heard = |_: Event| tell(progress.done.load(Ordering::SeqCst), all);
        run(assignment, &settings, &progress, stop, &mut heard).map_err(anyhow::Error::from)?;
        tell(progress.done.load(Ordering::SeqCst), all);
        Ok(())
    }

    /// The tables of the finished tasks: calibrations and validation runs, with units in the names of the columns.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn merged(&self) -> Result<[Table; 2], Error> {
        let tasks = self.0.tasks().map_err(anyhow::Error::from)?;
        let inventory = inventory::look(&self.0, &tasks, &[]).map_err(anyhow::Error::from)?;
        let file = self.0.study_file().map_err(anyhow::Error::from)?;
        let merged = merge::merge(&file, &tasks, &inventory);
        Ok([merged.calibrations, merged.validations])
    }
}
