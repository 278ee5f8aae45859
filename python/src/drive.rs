//! Measured drives.

use crate::{UsageError, raised};
use numpy::PyArray1;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::ffi::CString;
use std::path::{Path, PathBuf};

/// How a drive is made again in another process.
#[derive(Clone)]
pub enum Origin {
    /// The text of a table, and its name.
    Text(Vec<u8>, String),
    /// A file.
    File(PathBuf),
}

/// One measured follower behind its leader, prepared: gaps filled, one segment, one time step.
#[pyclass(module = "leadlag", frozen)]
#[derive(Clone)]
pub struct Drive {
    pub inner: leadlag::Drive,
    origin: Origin,
    follower: Option<String>,
    options: Vec<(String, Setting)>,
}

/// A value of an option.
#[derive(Clone, FromPyObject, IntoPyObject)]
pub enum Setting {
    Flag(bool),
    Whole(u32),
    Number(f64),
    Text(String),
}

/// The options of reading, by their names; those that are None are left out, and paths are texts.
pub fn options(given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, Setting)>> {
    let mut options = Vec::new();
    for (name, value) in given.into_iter().flatten() {
        if !value.is_none() {
            let path = value.hasattr("__fspath__")?.then(|| value.call_method0("__fspath__")).transpose()?;
            let name: String = name.extract()?;
            let value = path.unwrap_or(value);
            let told = || format!("{name}: expected a number, a text or True, found {value}");
            options.push((name.clone(), value.extract().map_err(|_| UsageError::new_err(told()))?));
        }
    }
    Ok(options)
}

/// A follower by number, name or id.
#[derive(FromPyObject)]
pub enum Follower {
    Number(u64),
    Name(String),
}

impl Follower {
    fn text(self) -> String {
        match self {
            Follower::Number(number) => number.to_string(),
            Follower::Name(name) => name,
        }
    }
}

/// The same as the library takes them.
pub fn reading(options: &[(String, Setting)]) -> PyResult<leadlag::Reading> {
    let mut reading = leadlag::Reading::default();
    for (name, value) in options {
        let text = || match value {
            Setting::Text(text) => Ok(text.clone()),
            Setting::Whole(number) => Ok(number.to_string()),
            _ => Err(wrong(name, "a text")),
        };
        let number = || match value {
            Setting::Number(number) => Ok(*number),
            Setting::Whole(number) => Ok(f64::from(*number)),
            _ => Err(wrong(name, "a number")),
        };
        match name.as_str() {
            "layout" => {
                reading.layout = Some(text()?.parse().map_err(|error| UsageError::new_err(format!("{error}")))?)
            }
            "columns" => reading.columns = Some(text()?),
            "trajectory" => reading.trajectory = Some(text()?),
            "segment" => {
                let Setting::Whole(segment) = value else { return Err(wrong(name, "a whole number from 1 on")) };
                reading.segment = Some(*segment);
            }
            "start" => reading.from = Some(number()?),
            "end" => reading.to = Some(number()?),
            "max_gap" => reading.max_gap_s = number()?,
            "smooth" => reading.smooth = matches!(value, Setting::Flag(true)),
            "resample" => reading.resample_s = Some(number()?),
            "reconcile" => {
                reading.reconcile = text()?.parse().map_err(|error| UsageError::new_err(format!("{error}")))?
            }
            "vehicle" => reading.vehicle = Some(text()?),
            "grade" => reading.grade = Some(text()?),
            "lead_length" => reading.lead_length_m = Some(number()?),
            "lead_start" => reading.lead_start_m = Some(number()?),
            _ => return Err(UsageError::new_err(format!("no option of reading is called {name}"))),
        }
    }
    Ok(reading)
}

fn wrong(name: &str, expected: &str) -> PyErr {
    UsageError::new_err(format!("{name}: expected {expected}"))
}

impl Drive {
    /// The drive; what is doubtful in it is a warning.
    fn warned(
        py: Python<'_>,
        origin: Origin,
        follower: Option<Follower>,
        given: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Drive> {
        let options = options(given)?;
        let drive = py.detach(|| Drive::of(origin, follower.map(Follower::text), options))?;
        warn(py, drive.inner.warnings())?;
        Ok(drive)
    }

    /// The text of a file that is all that was read, so that other machines need no file.
    fn alone(&self, path: &Path) -> Option<Vec<u8>> {
        let text = std::fs::read(path).ok().filter(|_| !self.inner.has_companions())?;
        let is_packed = text.starts_with(&[0x1F, 0x8B]) || text.starts_with(b"PAR1");
        (!is_packed).then_some(text)
    }

    fn of(origin: Origin, follower: Option<String>, options: Vec<(String, Setting)>) -> PyResult<Drive> {
        let reading = reading(&options)?;
        let recording = match &origin {
            Origin::Text(text, name) => reading.text(text, name),
            Origin::File(path) => reading.file(path),
        };
        let inner = recording.and_then(|recording| recording.drive(follower.as_deref())).map_err(raised)?;
        Ok(Drive { inner, origin, follower, options })
    }
}

/// Reads the drive of a follower from a file.
///
/// `path`: a file of any layout that leadlag knows, as CSV, gzip or Parquet; with `columns` any table. `follower`: 1 is right behind the platoon
/// leader; a name, or the id of a vehicle in a table with a column map; by default the only one.
///
/// Options: `columns`, a column map by name or file; `layout`; `trajectory`, an id in files that hold several; `segment`, from 1, between long
/// gaps; `start` and `end`, times of the file [s]; `max_gap`, gaps up to which are interpolated [s]; `smooth`, as the paper's authors did;
/// `resample`, a time step [s]; `reconcile`, "gap" or "speeds"; `vehicle`, a built-in one or FILE#NAME; `grade`, a table or "level";
/// `lead_length` [m]; `lead_start` [m], where the leader begins on the grade table.
///
/// Raises `Error` with line, what was expected and what was found where the file is faulty.
#[pyfunction]
#[pyo3(signature = (path, follower=None, **options))]
pub fn read(
    py: Python<'_>,
    path: PathBuf,
    follower: Option<Follower>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Drive> {
    Drive::warned(py, Origin::File(path), follower, options)
}

/// A made-up drive of one car behind another, to try things without data. `duration`: 20 s to some hours [s]. The same seed gives the same drive.
#[pyfunction]
#[pyo3(signature = (seed=1, duration=120.0))]
pub fn synthetic(py: Python<'_>, seed: u64, duration: f64) -> PyResult<Drive> {
    py.detach(|| {
        let made = leadlag::synthetic(seed, duration).and_then(|made| made.follower(1)).map_err(raised)?;
        let mut text = String::from("time_s,lead_speed_mps,speed_mps,spacing_m\n");
        let columns = [made.time(), made.lead_speed(), made.speed(), made.spacing()];
        for row in 0..made.len() {
            text += &columns.map(|column| column[row].to_string()).join(",");
            text.push('\n');
        }
        Drive::of(Origin::Text(text.into_bytes(), format!("synthetic_{seed}.csv")), None, Vec::new())
    })
}

#[pymethods]
impl Drive {
    /// The drive of a follower from a table in memory.
    ///
    /// `table`: columns `time_s`, `lead_speed_mps`, `speed_mps` and `spacing_m` (bumper to bumper), or those of another layout that leadlag knows, in
    /// a pandas, Polars or Arrow table or a mapping of arrays; with `columns` any table. `name` stands for the file in messages and results. The
    /// rest is as for `read`.
    #[new]
    #[pyo3(signature = (table, follower=None, *, name="table".to_owned(), **options))]
    fn new(
        table: &Bound<'_, PyAny>,
        follower: Option<Follower>,
        name: String,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Drive> {
        let py = table.py();
        // The text itself comes from a pickle.
        let text = match table.cast::<PyBytes>() {
            Ok(text) => text.as_bytes().to_vec(),
            Err(_) => py.import("leadlag._frames")?.call_method1("text_of", (table,))?.extract()?,
        };
        Drive::warned(py, Origin::Text(text, name), follower, options)
    }

    #[getter]
    fn label(&self) -> &str {
        self.inner.label()
    }

    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    #[getter]
    fn time_step(&self) -> f64 {
        self.inner.time_step()
    }

    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.time())
    }

    #[getter]
    fn spacing<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.spacing())
    }

    #[getter]
    fn speed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.speed())
    }

    #[getter]
    fn lead_speed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.lead_speed())
    }

    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.position())
    }

    #[getter]
    fn lead_position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.lead_position())
    }

    #[getter]
    fn preparation(&self) -> Vec<String> {
        self.inner.preparation()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.inner.warnings().to_vec()
    }

    fn __len__(&self) -> usize {
        self.inner.len()
    }

    fn __repr__(&self) -> String {
        let [first, last] = [self.inner.time()[0], self.inner.time()[self.inner.len() - 1]];
        let (label, samples, step) = (self.inner.label(), self.inner.len(), self.inner.time_step());
        format!("<Drive {label}: {samples} samples, {first} to {last} s, every {step} s>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let options = PyDict::new(py);
        for (name, value) in &self.options {
            options.set_item(name, value.clone())?;
        }
        let module = py.import("leadlag._native")?;
        let (origin, name) = match &self.origin {
            Origin::File(path) => match self.alone(path) {
                Some(text) => (PyBytes::new(py, &text).into_any(), Some(path.display().to_string())),
                None => (std::path::absolute(path)?.into_pyobject(py)?.into_any(), None),
            },
            Origin::Text(text, name) => (PyBytes::new(py, text).into_any(), Some(name.clone())),
        };
        let follower = self.follower.clone();
        Ok((module.getattr("_again")?, (origin, name, follower, options).into_pyobject(py)?.into_any()))
    }
}

/// The drive of a pickle, without a word.
#[pyfunction]
#[pyo3(name = "_again")]
pub fn again(
    py: Python<'_>,
    origin: &Bound<'_, PyAny>,
    name: Option<String>,
    follower: Option<String>,
    settings: &Bound<'_, PyDict>,
) -> PyResult<Drive> {
    let options = options(Some(settings))?;
    let origin = match name {
        Some(name) => Origin::Text(origin.extract()?, name),
        None => Origin::File(origin.extract()?),
    };
    py.detach(|| Drive::of(origin, follower, options))
}

/// Texts as warnings.
pub fn warn(py: Python<'_>, texts: &[String]) -> PyResult<()> {
    let category = py.get_type::<PyUserWarning>();
    texts
        .iter()
        .try_for_each(|text| PyErr::warn(py, &category, &CString::new(crate::in_keywords(text).replace('\0', " "))?, 1))
}
