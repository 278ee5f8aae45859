//! Calibrations: the settings, one fit, and a table of many.

use crate::drive::{Drive, warn};
use crate::evaluator::Evaluator;
use crate::fit::Fit;
use crate::reading::{options, reading};
use crate::threads::GPU;
use crate::watch::{OnCtrlC, Watch, done, watched};
use crate::{UsageError, raised};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Settings of a calibration; every method returns a changed copy.
#[pyclass(module = "leadlag", frozen)]
#[derive(Clone)]
pub struct Calibration {
    pub inner: leadlag::Calibration,
    /// Largest number of simulations of all replicates, to compute the progress.
    most: u64,
    /// The requested evaluator, if any.
    device: Option<String>,
}

impl Calibration {
    fn with(&self, inner: leadlag::Calibration) -> Calibration {
        Calibration { inner, ..self.clone() }
    }

    /// In a form that this process supports: a forked one cannot use the GPU of its parent.
    fn here(&self) -> PyResult<leadlag::Calibration> {
        match self.device.as_deref() {
            Some("lanes" | "reference") => Ok(self.inner.clone()),
            _ if !GPU.is_elsewhere() => Ok(self.inner.clone()),
            Some("gpu") => {
                let message = "device gpu: a forked process cannot use the GPU of its parent; start it by \
                               multiprocessing.get_context(\"spawn\"), or take device \"lanes\"";
                Err(UsageError::new_err(message))
            }
            _ => self.inner.clone().evaluator("lanes").map_err(raised),
        }
    }
}

/// Converts Python drives to those of the library.
pub fn plain(drives: &[Py<Drive>]) -> Vec<leadlag::Drive> {
    drives.iter().map(|drive| drive.get().inner.clone()).collect()
}

/// A model in the form of Python.
#[derive(FromPyObject)]
pub enum Base {
    Law(String, String, String),
    Named(String),
}

/// The model of a base and extensions.
pub fn variant(base: &Base, extensions: &[Extension]) -> PyResult<leadlag::Variant> {
    let bare = match base {
        Base::Named(name) => leadlag::Variant::named(name),
        Base::Law(name, text, parts) => leadlag::Law::from_text(name, text).and_then(|law| law.with(parts)),
    };
    let all = extensions.iter().try_fold(bare.map_err(raised)?, |model, extension| match extension {
        Extension::Text(name, text) => model.extend_text(name, text),
        Extension::Named(name) => model.extend(name),
    });
    all.map_err(raised)
}

#[pymethods]
impl Calibration {
    /// A model from its name, or from (name, text, parts) of a law, with extensions: names of built-in causes, paths of WGSL files, or
    /// (name, text).
    #[new]
    fn new(model: Base, extensions: Vec<Extension>) -> PyResult<Calibration> {
        let inner = variant(&model, &extensions)?.calibration();
        let most = inner.most_evaluations();
        Ok(Calibration { inner, most, device: None })
    }

    fn bounds(&self, given: &str) -> Calibration {
        self.with(self.inner.clone().bounds(given))
    }

    fn bound(&self, parameter: &str, lower: f64, upper: f64) -> Calibration {
        self.with(self.inner.clone().bound(parameter, lower, upper))
    }

    fn fix(&self, parameter: &str, value: f64) -> Calibration {
        self.with(self.inner.clone().fix(parameter, value))
    }

    /// Measure, convention, optimiser, evaluator and precision, each None for the default.
    fn words(
        &self,
        gof: Option<&str>,
        convention: Option<&str>,
        optimizer: Option<&str>,
        evaluator: Option<&str>,
        precision: Option<&str>,
    ) -> PyResult<Calibration> {
        let mut inner = self.inner.clone();
        let given = |inner: leadlag::Calibration, word: Option<&str>, set: Setter| match word {
            Some(word) => set(inner, word).map_err(raised),
            None => Ok(inner),
        };
        inner = given(inner, gof, leadlag::Calibration::minimise)?;
        inner = given(inner, convention, leadlag::Calibration::convention)?;
        inner = given(inner, optimizer, leadlag::Calibration::optimizer)?;
        inner = given(inner, evaluator, leadlag::Calibration::evaluator)?;
        inner = given(inner, precision, leadlag::Calibration::precision)?;
        Ok(Calibration { inner, most: self.most, device: evaluator.map(str::to_owned) })
    }

    /// Seed, replicates, evaluations at most, and whether intervals are estimated, each None for the default.
    fn numbers(
        &self,
        seed: Option<u64>,
        replicates: Option<u64>,
        max_evaluations: Option<u64>,
        intervals: Option<bool>,
    ) -> Calibration {
        let mut inner = self.inner.clone();
        inner = seed.map_or(inner.clone(), |seed| inner.seed(seed));
        inner = replicates.map_or(inner.clone(), |replicates| inner.replicates(replicates));
        inner = max_evaluations.map_or(inner.clone(), |most| inner.max_evaluations(most));
        inner = intervals.map_or(inner.clone(), |wanted| inner.intervals(wanted));
        let most = inner.most_evaluations();
        Calibration { inner, most, ..self.clone() }
    }

    /// The same with this time at the start \[s\] in which the car is the measured one.
    fn history(&self, seconds: f64) -> Calibration {
        Calibration { inner: self.inner.clone().history(seconds), ..self.clone() }
    }

    /// The same with these parameters of each driver's own.
    fn own(&self, parameters: Vec<String>) -> Calibration {
        let parameters: Vec<&str> = parameters.iter().map(String::as_str).collect();
        Calibration { inner: self.inner.clone().own(&parameters), ..self.clone() }
    }

    /// The same with cross-validation in this number of folds.
    fn folds(&self, folds: u64) -> Calibration {
        Calibration { inner: self.inner.clone().folds(folds), ..self.clone() }
    }

    /// The name of the model.
    #[getter]
    fn model(&self) -> String {
        self.inner.model()
    }

    /// The parameters of the model, each with its column in the table of a fleet.
    #[getter]
    fn columns(&self) -> Vec<(&'static str, String)> {
        self.inner.columns()
    }

    /// What is doubtful about it on these drives.
    fn warnings(&self, drives: Vec<Py<Drive>>) -> PyResult<Vec<String>> {
        let drives: Vec<&leadlag::Drive> = drives.iter().map(|drive| &drive.get().inner).collect();
        self.inner.warnings(&drives).map_err(raised)
    }

    /// Calibrates one parameter set on these drives; the fit, and whether it was interrupted.
    fn run(
        &self,
        py: Python<'_>,
        drives: Vec<Py<Drive>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Fit, Option<PyErr>)> {
        let (calibration, most) = (self.here()?, self.most);
        let plain = plain(&drives);
        let search = {
            let drives = plain.clone();
            move |watch: &Watch| {
                let drives: Vec<&leadlag::Drive> = drives.iter().collect();
                let mut evaluations = Vec::new();
                calibration.run_on(&drives, &mut |told| {
                    let replicate = told.replicate as usize;
                    evaluations.resize(evaluations.len().max(replicate + 1), 0);
                    evaluations[replicate] = told.evaluations;
                    let done = evaluations.iter().sum::<u64>();
                    watch.tell(done as f64 / most as f64, || match told.best {
                        Some(best) => format!("{done} simulations, best {best:.6}"),
                        None => format!("{done} simulations, none feasible yet"),
                    });
                    if watch.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                })
            }
        };
        let (inner, interrupted) = watched(py, progress.as_ref(), OnCtrlC::Keep, search)?;
        warn(py, inner.warnings())?;
        Ok((Fit::of(inner, plain, drives), interrupted))
    }

    /// An evaluator of candidates on these drives.
    fn evaluate_on(&self, py: Python<'_>, drives: Vec<Py<Drive>>) -> PyResult<Evaluator> {
        let (calibration, drives) = (self.here()?, plain(&drives));
        done(py, move || {
            let inner = calibration.evaluate_on(&drives.iter().collect::<Vec<_>>())?;
            Ok(Evaluator::of(inner, &drives))
        })
    }
}

type Setter = fn(leadlag::Calibration, &str) -> Result<leadlag::Calibration, leadlag::Error>;

/// An extension by its name, path or text.
#[derive(FromPyObject)]
pub enum Extension {
    Text(String, String),
    Named(String),
}

type Columns<'py> = Bound<'py, PyDict>;

/// Leader-follower pairs of a data set.
#[pyclass(module = "leadlag", frozen)]
pub struct Pairs {
    pub(crate) inner: leadlag::Pairs,
}

/// Every pair of files, folders, or of one text.
#[pyfunction]
pub fn pairs_of_files(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    text: Option<Vec<u8>>,
    settings: &Bound<'_, PyDict>,
) -> PyResult<Pairs> {
    let reading = reading(&options(Some(settings))?)?;
    let inner = done(py, move || match text {
        Some(text) => leadlag::Pairs::of_text(&reading, &text, "table"),
        None => leadlag::Pairs::read(&reading, &paths),
    })?;
    Ok(Pairs { inner })
}

/// Drives in memory, a pair each.
#[pyfunction]
pub fn pairs_of_drives(drives: Vec<Py<Drive>>) -> Pairs {
    let drives: Vec<&leadlag::Drive> = drives.iter().map(|drive| &drive.get().inner).collect();
    Pairs { inner: leadlag::Pairs::of_drives(&drives) }
}

#[pymethods]
impl Pairs {
    /// Faults of files and signals, one line each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.inner.warnings()
    }
}

/// Calibrates every pair; columns by name, and the interruption if there was one.
#[pyfunction]
#[pyo3(signature = (pairs, calibrations, progress, holdout = None))]
pub fn calibrate_pairs<'py>(
    py: Python<'py>,
    pairs: &Pairs,
    calibrations: Vec<Py<Calibration>>,
    progress: Option<Py<PyAny>>,
    holdout: Option<f64>,
) -> PyResult<(Columns<'py>, Option<PyErr>)> {
    let (pairs, progress) = (pairs.inner.clone(), progress.as_ref());
    let pairs = match holdout {
        Some(share) => pairs.hold_back(share).map_err(raised)?,
        None => pairs,
    };
    let each = calibrations.iter().map(|one| one.get().here()).collect::<PyResult<_>>()?;
    let fleet = leadlag::Fleet::of_calibrations(each).map_err(raised)?;
    let (table, interrupted) = watched(py, progress, OnCtrlC::Keep, move |watch| {
        fleet.run_on(&pairs, &|| watch.stopped(), &|done, whole| {
            watch.tell(done as f64 / whole.max(1) as f64, || format!("{done} of {whole} calibrations"));
        })
    })?;
    let columns = PyDict::new(py);
    for column in &table.columns {
        use leadlag::Values::{Flag, Integer, Number, Text};
        let values = match &column.values {
            Number(values) => numbers(py, values.iter().map(|value| value.unwrap_or(f64::NAN))),
            // Without a gap, drives are not cut.
            Integer(values) => match values.iter().copied().collect::<Option<Vec<i64>>>() {
                Some(whole) => PyArray1::from_vec(py, whole).into_any(),
                None => numbers(py, values.iter().map(|value| value.map_or(f64::NAN, |value| value as f64))),
            },
            Flag(values) => PyList::new(py, values)?.into_any(),
            Text(values) => PyList::new(py, values)?.into_any(),
        };
        columns.set_item(&column.name, values)?;
    }
    Ok((columns, interrupted))
}

fn numbers(py: Python<'_>, values: impl Iterator<Item = f64>) -> Bound<'_, PyAny> {
    PyArray1::from_vec(py, values.collect()).into_any()
}
