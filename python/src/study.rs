//! What `leadlag.study` needs of the library: studies in folders, and the trajectories of files.

use crate::reading::{options, reading};
use crate::watch::{OnCtrlC, done, watched};
use leadlag::Study;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Lays out the study of a plan in a folder, or continues the one there; returns the ids of the tasks that are not done.
#[pyfunction]
pub fn plan_study(py: Python<'_>, plan: PathBuf, folder: PathBuf, data: Option<PathBuf>) -> PyResult<Vec<String>> {
    done(py, move || Study::create_with(plan, folder, data.as_deref())?.missing())
}

/// Computes these tasks of the study of a folder.
#[pyfunction]
pub fn run_study(py: Python<'_>, folder: PathBuf, data: Option<PathBuf>, tasks: Vec<String>) -> PyResult<()> {
    let work = move |watch: &crate::watch::Watch| {
        Study::open(folder)?.run_some(&tasks, data.as_deref(), &|| watch.stopped(), &mut |_, _| {})
    };
    let ((), interrupted) = watched(py, None, OnCtrlC::Keep, work)?;
    interrupted.map_or(Ok(()), Err)
}

/// Writes the tables of the study of a folder.
#[pyfunction]
pub fn merge_study(py: Python<'_>, folder: PathBuf) -> PyResult<()> {
    done(py, move || leadlag::cli::merge(&folder))
}

/// The ids of the trajectories of each file, those that the options name; none for a file that cannot be read.
#[pyfunction]
pub fn trajectories(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    settings: &Bound<'_, PyDict>,
) -> PyResult<Vec<Vec<Option<String>>>> {
    let reading = reading(&options(Some(settings))?)?;
    done(py, move || {
        let ids = |path| reading.file(path).map_or_else(|_| Vec::new(), |recording| recording.trajectories());
        Ok(paths.iter().map(ids).collect())
    })
}
