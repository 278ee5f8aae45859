//! Diagnoses.

use crate::drive::Drive;
use crate::model::{Base, Extension, Pairs, plain, variant};
use crate::raised;
use crate::watch::{OnCtrlC, done, watched};
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Result of a diagnosis; `leadlag.diagnose` makes it.
#[pyclass(module = "leadlag", frozen)]
pub struct Findings {
    inner: leadlag::Findings,
    /// The diagnosed model, and the texts of the tried causes that are not built in, in the form of Python.
    asked: (Py<PyAny>, Vec<(String, String)>),
}

/// Settings of a diagnosis: effort, seed, causes as names and texts, bounds of sets and files, and bounds of single parameters.
type Settings = (String, u64, Vec<(String, String)>, Vec<String>, Vec<(String, f64, f64)>);

fn asked(py: Python<'_>, model: &Py<PyAny>, settings: &Settings) -> PyResult<leadlag::Diagnosis> {
    let (effort, seed, causes, bounds, single) = settings;
    let base: Base = model.getattr(py, "base")?.extract(py)?;
    let extend: Vec<Extension> = model.getattr(py, "extend")?.extract(py)?;
    let mut diagnosis = variant(&base, &extend)?.diagnosis().effort(effort).map_err(raised)?.seed(*seed);
    for (name, text) in causes {
        diagnosis = diagnosis.cause(name, text).map_err(raised)?;
    }
    for given in bounds {
        diagnosis = diagnosis.bounds(given);
    }
    for (parameter, lower, upper) in single {
        diagnosis = diagnosis.bound(parameter, *lower, *upper);
    }
    Ok(diagnosis)
}

/// Diagnoses which effects a model lacks on drives.
#[pyfunction]
pub fn diagnose(
    py: Python<'_>,
    drives: Vec<Py<Drive>>,
    holdout: Vec<Py<Drive>>,
    model: Py<PyAny>,
    settings: Settings,
    correct: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Findings> {
    let diagnosis = asked(py, &model, &settings)?.correct(correct);
    let (drives, holdout) = (plain(&drives), plain(&holdout));
    let (inner, interrupted) = watched(py, progress.as_ref(), OnCtrlC::Leave, move |watch| {
        let [drives, holdout] = [&drives, &holdout].map(|drives| drives.iter().collect::<Vec<_>>());
        diagnosis.run_on(&drives, &holdout, &mut |told| {
            watch.tell(told.done, || told.stage.clone());
            if watch.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    })?;
    interrupted.map_or(Ok(Findings { inner, asked: (model, settings.2) }), Err)
}

/// Diagnoses which effects a model lacks for the drivers of a fleet.
#[pyfunction]
pub fn diagnose_pairs(
    py: Python<'_>,
    pairs: &Pairs,
    model: Py<PyAny>,
    settings: Settings,
    progress: Option<Py<PyAny>>,
) -> PyResult<Findings> {
    let (diagnosis, pairs) = (asked(py, &model, &settings)?, pairs.inner.clone());
    let (inner, interrupted) = watched(py, progress.as_ref(), OnCtrlC::Leave, move |watch| {
        diagnosis.run_all_on(&pairs, &mut |told| {
            watch.tell(told.done, || told.stage.clone());
            if watch.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    })?;
    interrupted.map_or(Ok(Findings { inner, asked: (model, settings.2) }), Err)
}

#[pymethods]
impl Findings {
    /// The answer in a word: named, nothing, ambiguous, unexplained, not_testable.
    #[getter]
    fn verdict(&self) -> &'static str {
        self.inner.verdict()
    }

    /// Why, in a sentence.
    #[getter]
    fn reason(&self) -> &str {
        self.inner.reason()
    }

    /// The causes that the likelihood adopts, in the order of adoption.
    #[getter]
    fn causes(&self) -> Vec<&str> {
        self.inner.causes()
    }

    /// The causes with which the model follows unseen drives better.
    #[getter]
    fn recommended(&self) -> Vec<&str> {
        self.inner.recommended()
    }

    /// The text of `diagnosis.json`, the complete result.
    fn to_json(&self) -> String {
        self.inner.to_json()
    }

    /// The whole answer in words.
    #[getter]
    fn text(&self) -> String {
        self.inner.text()
    }

    /// The recommended model, otherwise the base with the named causes, as a `leadlag.Model` to calibrate; the base itself if nothing was found.
    fn apply<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (recommended, named) = (self.inner.recommended(), self.inner.causes());
        let causes = if recommended.is_empty() { named } else { recommended };
        let (model, own) = &self.asked;
        py.import("leadlag._api")?.call_method1("extended", (model, causes, own.clone()))
    }

    /// Writes the files of `leadlag diagnose --out`.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let findings = self.inner.clone();
        done(py, move || leadlag::cli::save_findings(&findings, &folder))
    }

    /// The HTML report: written to a file if a path is given, else shown in a notebook.
    #[pyo3(signature = (path=None))]
    fn report<'py>(slf: &Bound<'py, Self>, path: Option<PathBuf>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._show")?.call_method1("report", (slf, "diagnosis.json", path))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._show")?.call_method1("findings_html", (slf,))
    }

    fn __repr__(&self) -> String {
        self.inner.to_string().trim_end().to_owned()
    }
}
