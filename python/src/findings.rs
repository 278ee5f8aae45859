//! Diagnoses.

use crate::drive::Drive;
use crate::model::{Base, Extension, variant};
use crate::raised;
use crate::watch::watched;
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// What a diagnosis found.
#[pyclass(module = "leadlag", frozen)]
pub struct Findings {
    inner: leadlag::Findings,
}

/// Diagnoses what a model lacks on drives.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "each is a keyword argument of the Python function")]
pub fn diagnose(
    py: Python<'_>,
    drives: Vec<Py<Drive>>,
    holdout: Vec<Py<Drive>>,
    base: Base,
    extend: Vec<Extension>,
    effort: &str,
    seed: u64,
    causes: Vec<(String, String)>,
    bounds: Vec<String>,
    single: Vec<(String, f64, f64)>,
    correct: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Findings> {
    let mut diagnosis = variant(&base, &extend)?.diagnosis().effort(effort).map_err(raised)?;
    diagnosis = diagnosis.seed(seed).correct(correct);
    for (name, text) in causes {
        diagnosis = diagnosis.cause(&name, &text).map_err(raised)?;
    }
    for given in bounds {
        diagnosis = diagnosis.bounds(&given);
    }
    for (parameter, lower, upper) in single {
        diagnosis = diagnosis.bound(&parameter, lower, upper);
    }
    let drives: Vec<&leadlag::Drive> = drives.iter().map(|drive| &drive.get().inner).collect();
    let holdout: Vec<&leadlag::Drive> = holdout.iter().map(|drive| &drive.get().inner).collect();
    let (inner, interrupted) = watched(py, progress.as_ref(), |watch| {
        diagnosis.run_on(&drives, &holdout, &mut |told| {
            watch.tell(told.done, || told.stage.clone());
            if watch.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
    })?;
    interrupted.map_or(Ok(Findings { inner }), Err)
}

#[pymethods]
impl Findings {
    #[getter]
    fn verdict(&self) -> &'static str {
        self.inner.verdict()
    }

    #[getter]
    fn reason(&self) -> &str {
        self.inner.reason()
    }

    #[getter]
    fn causes(&self) -> Vec<&str> {
        self.inner.causes()
    }

    #[getter]
    fn recommended(&self) -> Vec<&str> {
        self.inner.recommended()
    }

    fn to_json(&self) -> String {
        self.inner.to_json()
    }

    /// The whole answer in words.
    #[getter]
    fn text(&self) -> String {
        self.inner.text()
    }

    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| leadlag::cli::save_findings(&self.inner, &folder)).map_err(raised)
    }

    /// The HTML report: written to a file where a path is given, else shown in a notebook.
    #[pyo3(signature = (path=None))]
    fn report<'py>(slf: &Bound<'py, Self>, path: Option<PathBuf>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._show")?.call_method1("report", (slf, "diagnosis.json", path))
    }

    fn __repr__(&self) -> String {
        self.inner.to_string().trim_end().to_owned()
    }
}
