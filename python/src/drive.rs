//! Measured drives.

use crate::reading::{Follower, options, reading};
use crate::watch::done;
use crate::{UsageError, raised};
use numpy::PyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PySlice};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The recipe to make a drive again in another process.
#[derive(Clone)]
pub enum Origin {
    /// The text of a table, and its name.
    Text(Vec<u8>, String),
    /// A file.
    File(PathBuf),
}

/// One measured follower behind its leader, prepared: gaps filled, one segment, one time step.
///
/// `table` has the columns `time_s` [s], `lead_speed_mps` [m/s], `speed_mps` [m/s] and `spacing_m` (bumper to bumper) [m], or those of another layout
/// that leadlag knows, as a pandas, Polars or Arrow table or a mapping of arrays; with `columns` any table. A masked value is a missing one.
///
/// `name` names the follower, in messages and results too: drives with different names have different drivers. `follower` and the options are those of `leadlag.read`.
///
/// `drive[10:60]` is the part from 10 to 60 s, both included.
#[pyclass(module = "leadlag", frozen)]
#[derive(Clone)]
pub struct Drive {
    pub inner: leadlag::Drive,
    origin: Arc<Origin>,
    follower: Option<String>,
    options: Vec<(String, String)>,
}

impl Drive {
    /// The drive; doubtful values become warnings.
    fn warned(
        py: Python<'_>,
        origin: Origin,
        follower: Option<Follower>,
        name: Option<String>,
        given: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Drive> {
        let mut options = options(given.as_ref())?;
        options.extend(name.map(|name| ("name".to_owned(), name)));
        let drive = Drive::read(py, origin, follower.map(Follower::text), options)?;
        warn(py, drive.inner.warnings())?;
        Ok(drive)
    }

    fn read(
        py: Python<'_>,
        origin: Origin,
        follower: Option<String>,
        options: Vec<(String, String)>,
    ) -> PyResult<Drive> {
        let (name, others): (Vec<_>, Vec<_>) = options.iter().cloned().partition(|(option, _)| option == "name");
        let name = name.into_iter().next().map(|(_, name)| name);
        let reading = reading(&others)?;
        let (origin, whose) = (Arc::new(origin), follower.clone());
        let source = Arc::clone(&origin);
        let inner = done(py, move || {
            let recording = match &*source {
                Origin::Text(text, name) => reading.text(text, name),
                Origin::File(path) => reading.file(path),
            };
            let drive = recording?.drive(whose.as_deref())?;
            Ok(name.map_or(drive.clone(), |name| drive.named(&name)))
        })?;
        Ok(Drive { inner, origin, follower, options })
    }

    /// The part between two times [s], both included.
    fn part(&self, from: f64, to: f64) -> PyResult<Drive> {
        let inner = self.inner.between(from, to).map_err(raised)?;
        // A window of the same trajectory gives it again; the numbers of its segments may differ.
        let replaced = ["start", "end", "segment", "trajectory"];
        let mut options = self.options.clone();
        let id = options.iter().find(|(name, _)| name == "trajectory").map(|(_, id)| id.clone());
        let id = inner.trajectory().map(str::to_owned).or(id);
        options.retain(|(name, _)| !replaced.contains(&name.as_str()));
        options.extend([("start", from), ("end", to)].map(|(name, time)| (name.to_owned(), time.to_string())));
        options.extend(id.map(|id| ("trajectory".to_owned(), id)));
        Ok(Drive { inner, origin: Arc::clone(&self.origin), follower: self.follower.clone(), options })
    }

    fn ends(&self) -> [f64; 2] {
        let time = self.inner.time();
        [time[0], time[time.len() - 1]]
    }

    /// The complete text of a file, so that other machines do not need the file.
    fn alone(&self, path: &Path) -> Option<Vec<u8>> {
        let text = std::fs::read(path).ok().filter(|_| !self.inner.has_companions())?;
        let is_packed = text.starts_with(&[0x1F, 0x8B]) || text.starts_with(b"PAR1");
        (!is_packed).then_some(text)
    }
}

/// Reads the drive of a follower from a file.
///
/// `path`: a file of any layout that leadlag knows, as CSV, gzip or Parquet; with `columns` any table. `follower`: 1 is right behind the platoon
/// leader; a name, or the id of a vehicle in a table with a column map; by default the only one.
///
/// Options, each a keyword:
///
/// - `name`: the name of the follower, if the file has none;
/// - `columns`: a column map: the name of a built-in one, a TOML file, or a mapping such as `{"time": "t", "speed": ("v", "km/h"), "lead_speed":
///   ("v_lead", "km/h"), "gap": "gap"}`, in SI units unless it names others; it may be a whole map with `rows` and `columns`;
/// - `layout`: by default detected from the header;
/// - `trajectory`: an id, in files that hold several; `segment`: from 1, between long gaps, by default the longest;
/// - `start` and `end`: times as in the file [s];
/// - `max_gap`: longest gap that is interpolated [s], 1 by default;
/// - `smooth`: whether signals are smoothed as the paper's authors did;
/// - `correct`: whether faults of the data are corrected where possible;
/// - `resample`: a time step [s];
/// - `reconcile`: the anchor of the spacing, "gap" (the default) or "speeds";
/// - `vehicle`: the follower's car, a built-in one or FILE#NAME; `grade`: a table or "level";
/// - `lead_length`: length of the vehicle ahead [m]; `lead_start`: its start on the grade table [m].
///
/// Raises `Error` with the line, the expected and the found value if the file is faulty.
#[pyfunction]
#[pyo3(signature = (path, follower=None, *, name=None, **options))]
pub fn read(
    py: Python<'_>,
    path: PathBuf,
    follower: Option<Follower>,
    name: Option<String>,
    options: Option<Bound<'_, PyDict>>,
) -> PyResult<Drive> {
    Drive::warned(py, Origin::File(path), follower, name, options)
}

/// A made-up drive of one car behind another, to try things without data.
///
/// `duration`: 20 s to some hours [s]. The same seed gives the same drive.
#[pyfunction]
#[pyo3(signature = (seed=1, duration=120.0))]
pub fn synthetic(py: Python<'_>, seed: u64, duration: f64) -> PyResult<Drive> {
    let text = done(py, move || {
        let made = leadlag::synthetic(seed, duration)?.follower(1)?;
        let mut text = String::from("time_s,lead_speed_mps,speed_mps,spacing_m\n");
        let columns = [made.time(), made.lead_speed(), made.speed(), made.spacing()];
        for row in 0..made.len() {
            text += &columns.map(|column| column[row].to_string()).join(",");
            text.push('\n');
        }
        Ok(text)
    })?;
    Drive::read(py, Origin::Text(text.into_bytes(), format!("synthetic_{seed}.csv")), None, Vec::new())
}

#[pymethods]
impl Drive {
    #[new]
    #[pyo3(signature = (table, follower=None, *, name=None, **options))]
    fn new(
        table: &Bound<'_, PyAny>,
        follower: Option<Follower>,
        name: Option<String>,
        options: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Drive> {
        let py = table.py();
        let text = py.import("leadlag._frames")?.call_method1("text_of", (table,))?.extract()?;
        let origin = Origin::Text(text, name.clone().unwrap_or_else(|| "table".to_owned()));
        Drive::warned(py, origin, follower, name, options)
    }

    /// `FILE follower N`, with trajectory id and segment if there are several.
    #[getter]
    fn label(&self) -> &str {
        self.inner.label()
    }

    /// Name of the follower: as given, else as in the file.
    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    /// Time step [s].
    #[getter]
    fn time_step(&self) -> f64 {
        self.inner.time_step()
    }

    /// Times [s], as in the file, shape (samples,).
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.time())
    }

    /// Bumper-to-bumper spacing [m], shape (samples,).
    #[getter]
    fn spacing<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.spacing())
    }

    /// Speed of the follower [m/s], shape (samples,).
    #[getter]
    fn speed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.speed())
    }

    /// Speed of the preceding vehicle [m/s], shape (samples,).
    #[getter]
    fn lead_speed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.lead_speed())
    }

    /// Position of the follower along the road [m], shape (samples,).
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.position())
    }

    /// Position of the preceding vehicle [m], of its rear bumper if its length is unknown, shape (samples,).
    #[getter]
    fn lead_position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.inner.lead_position())
    }

    /// Changes to the data, one line each.
    #[getter]
    fn preparation(&self) -> Vec<String> {
        self.inner.preparation()
    }

    /// Doubtful values of the data, one line each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.inner.warnings().to_vec()
    }

    /// Columns `time_s`, `lead_speed_mps`, `speed_mps` and `spacing_m` as a pandas DataFrame, which `Drive` accepts.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._frames")?.call_method1("drive_frame", (slf,))
    }

    /// The same signals as an xarray Dataset over `time_s`, with units in `attrs`.
    fn to_xarray<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._frames")?.call_method1("dataset", (slf.call_method0("to_pandas")?,))
    }

    /// Spacing and both speeds over time, drawn by matplotlib; returns the figure.
    fn plot<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._show")?.call_method1("drive_plot", (slf,))
    }

    /// The drive cut at a time [s], or at several, into drives without a common sample, such as one to calibrate on and one to test.
    ///
    /// The sample at the cut is the first one of the later drive.
    fn split(&self, at: &Bound<'_, PyAny>) -> PyResult<Vec<Drive>> {
        let mut cuts: Vec<f64> = at.extract().or_else(|_| at.extract().map(|one| vec![one]))?;
        cuts.sort_by(f64::total_cmp);
        let [first, last] = self.ends();
        if let Some(wrong) = cuts.iter().find(|cut| !(first < **cut && **cut <= last)) {
            let message = format!("at: expected times after {first} s, up to {last} s, found {wrong}");
            return Err(UsageError::new_err(message));
        }
        // Between two samples, so that neither drive has both.
        let half = 0.5 * self.inner.time_step();
        let starts = std::iter::once(first).chain(cuts.iter().map(|cut| cut - half));
        let ends = cuts.iter().map(|cut| cut - half).chain([last]);
        starts.zip(ends).map(|(from, to)| self.part(from, to)).collect()
    }

    fn __getitem__(&self, times: &Bound<'_, PyAny>) -> PyResult<Drive> {
        let told = || "expected times such as drive[10:60], which is the part from 10 to 60 s; samples are those of arrays: drive.speed[3]";
        let slice = times.cast::<PySlice>().map_err(|_| PyTypeError::new_err(told()))?;
        let end = |name: &str| slice.getattr(name)?.extract::<Option<f64>>();
        if !slice.getattr("step")?.is_none() {
            return Err(PyTypeError::new_err(told()));
        }
        let [first, last] = self.ends();
        self.part(end("start")?.unwrap_or(first), end("stop")?.unwrap_or(last))
    }

    fn __len__(&self) -> usize {
        self.inner.len()
    }

    fn __repr__(&self) -> String {
        let [first, last] = self.ends();
        let (label, samples, step) = (self.inner.label(), self.inner.len(), self.inner.time_step());
        format!("<Drive {label}: {samples} samples, {first} to {last} s, every {step} s>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let options = PyDict::new(py);
        for (name, value) in &self.options {
            options.set_item(name, value)?;
        }
        let module = py.import("leadlag._native")?;
        let (origin, name) = match &*self.origin {
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

/// The drive of a pickle, without warnings.
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
    Drive::read(py, origin, follower, options)
}

/// Doubtful values, as Python warnings.
pub fn warn(py: Python<'_>, texts: &[String]) -> PyResult<()> {
    if texts.is_empty() {
        return Ok(());
    }
    py.import("leadlag._warnings")?.call_method1("tell", (texts,)).map(drop)
}
