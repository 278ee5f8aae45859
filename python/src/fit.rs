//! Result of a calibration.

use crate::drive::{Drive, warn};
use crate::raised;
use crate::watch::done;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Calibrated parameters, with intervals and correlations; `leadlag.calibrate` makes it.
///
/// `Fit(json, drives)` makes a fit from the text of a `result.json` and its drives; `drives` may be empty.
#[pyclass(module = "leadlag", frozen)]
pub struct Fit {
    inner: leadlag::Fit,
    drives: Vec<leadlag::Drive>,
    /// The same in the form of Python.
    own: Vec<Py<Drive>>,
}

impl Fit {
    pub fn of(inner: leadlag::Fit, drives: Vec<leadlag::Drive>, own: Vec<Py<Drive>>) -> Fit {
        Fit { inner, drives, own }
    }
}

/// Python objects from the result file.
fn of_result<'py>(fit: &Bound<'py, Fit>, function: &str) -> PyResult<Bound<'py, PyAny>> {
    fit.py().import("leadlag._fit")?.call_method1(function, (fit,))
}

/// For pickle: a constructor and its arguments.
type Reduced = (Py<PyAny>, (String, Vec<Py<Drive>>));

#[pymethods]
impl Fit {
    #[new]
    #[pyo3(signature = (json, drives=Vec::new()), text_signature = "(json, drives=())")]
    fn new(json: &str, drives: Vec<Py<Drive>>) -> PyResult<Fit> {
        let inner = leadlag::Fit::from_json(json).map_err(raised)?;
        let plain = drives.iter().map(|drive| drive.get().inner.clone()).collect();
        Ok(Fit { inner, drives: plain, own: drives })
    }

    /// The drives that it was calibrated on.
    #[getter]
    fn drives(&self, py: Python<'_>) -> Vec<Py<Drive>> {
        self.own.iter().map(|drive| drive.clone_ref(py)).collect()
    }

    /// The model, by its name.
    #[getter]
    fn model(&self) -> String {
        self.inner.model()
    }

    /// The minimised measure, by the f64 reference.
    #[getter]
    fn score(&self) -> f64 {
        self.inner.score()
    }

    /// The calibrated parameters by the paper's symbols, in SI units.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.inner.parameters().iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
        Ok(dict)
    }

    /// 95 % intervals of the parameters that the data determine.
    #[getter]
    fn intervals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.inner.intervals().iter().try_for_each(|(name, [lower, upper])| dict.set_item(name, (lower, upper)))?;
        Ok(dict)
    }

    /// The units of the parameters.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.inner.units().iter().try_for_each(|(name, unit)| dict.set_item(name, unit))?;
        Ok(dict)
    }

    /// Parameters within 0.1 % of their range of a bound.
    #[getter]
    fn at_bound(&self) -> Vec<String> {
        self.inner.at_bound().to_vec()
    }

    /// RMSE of spacing [m], speed [m/s] and acceleration [m/s²] by `s`, `v` and `a`; the mean over several drives.
    #[getter]
    fn rmse<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        of_result(slf, "rmse")
    }

    /// Simulated candidates of all replicates.
    #[getter]
    fn evaluations<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        of_result(slf, "evaluations")
    }

    /// Correlations between the errors of the parameters, as a pandas DataFrame; None without intervals.
    #[getter]
    fn correlation<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        of_result(slf, "correlation")
    }

    /// Covariances of the parameters as a pandas DataFrame: the correlations times standard errors, which are the widths of the 95 % intervals over
    /// 3.92. NaN for parameters that the data do not determine; None without correlations.
    #[getter]
    fn covariance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        of_result(slf, "covariance")
    }

    /// A pandas DataFrame with a row per parameter: value, unit, ends of the 95 % interval, whether it is at a bound, and whether the data determine it.
    ///
    /// `determined` is None for fixed parameters, and without intervals.
    fn summary<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        of_result(slf, "summary")
    }

    /// Content of `to_json`, as a dict.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        of_result(slf, "to_dict")
    }

    /// The text of `result.json`, as the command line writes it.
    fn to_json(&self) -> String {
        self.inner.to_json()
    }

    /// Simulates the calibrated model on a drive, by the f64 reference.
    ///
    /// `drive` and the options of reading are those of `leadlag.calibrate`.
    #[pyo3(signature = (drive, **reading))]
    fn simulate(&self, drive: &Bound<'_, PyAny>, reading: Option<&Bound<'_, PyDict>>) -> PyResult<Simulation> {
        let py = drive.py();
        let drive: Py<Drive> = py.import("leadlag._drives")?.call_method1("one", (drive, reading))?.extract()?;
        let (fit, drive) = (self.inner.clone(), drive.get().inner.clone());
        let inner = done(py, move || fit.simulate(&drive))?;
        warn(py, &inner.warnings)?;
        Ok(Simulation { inner })
    }

    /// The same as `simulate`, under the name of scikit-learn.
    #[pyo3(signature = (drive, **reading))]
    fn predict(&self, drive: &Bound<'_, PyAny>, reading: Option<&Bound<'_, PyDict>>) -> PyResult<Simulation> {
        self.simulate(drive, reading)
    }

    /// Writes the files of `leadlag calibrate --out`, without the times.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let (fit, drives) = (self.inner.clone(), self.drives.clone());
        done(py, move || leadlag::cli::save(&fit, &drives.iter().collect::<Vec<_>>(), &folder))
    }

    /// The HTML report: written to a file if a path is given, else shown in a notebook.
    #[pyo3(signature = (path=None))]
    fn report<'py>(slf: &Bound<'py, Self>, path: Option<PathBuf>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._show")?.call_method1("report", (slf, "result.json", path))
    }

    /// Measured and simulated signals over time, drawn by matplotlib; returns the figure.
    fn plot<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._show")?.call_method1("plot", (slf,))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._show")?.call_method1("fit_html", (slf,))
    }

    /// Spacing, speed and acceleration on the first drive, as SVG; None without a drive.
    fn _picture(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let Some(first) = self.drives.first() else { return Ok(None) };
        py.detach(|| self.inner.picture(first)).map(Some).map_err(raised)
    }

    fn __repr__(&self) -> String {
        self.inner.to_string().trim_end().to_owned()
    }

    fn __reduce__(slf: PyRef<'_, Self>) -> PyResult<Reduced> {
        let make = slf.py().import("leadlag._native")?.getattr("Fit")?;
        Ok((make.unbind(), (slf.to_json(), slf.drives(slf.py()))))
    }
}

/// A run of a calibrated model on a drive, up to its end; `Fit.simulate` makes one.
#[pyclass(module = "leadlag", frozen)]
pub struct Simulation {
    inner: leadlag::Simulation,
}

#[pymethods]
impl Simulation {
    /// Times [s], shape (samples,).
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.time)
    }

    /// Simulated spacing [m], shape (samples,).
    #[getter]
    fn spacing<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.spacing)
    }

    /// Simulated speed [m/s], shape (samples,).
    #[getter]
    fn speed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.speed)
    }

    /// Simulated acceleration [m/s²], shape (samples,).
    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.acceleration)
    }

    /// Every measure of the error that the drive allows, by name: `nrmse_sva`, `rmse_s`, ...
    #[getter]
    fn scores<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.inner.scores.iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
        Ok(dict)
    }

    /// Why the run ended early: a crash, for example.
    #[getter]
    fn ended(&self) -> Option<String> {
        self.inner.ended.clone()
    }

    fn __repr__(&self) -> String {
        let score =
            self.inner.scores.get("nrmse_sva").map_or(String::new(), |score| format!(", NRMSE(s,v,a) {score:.6}"));
        let ended = self.inner.ended.as_ref().map_or(String::new(), |why| format!(", ended early: {why}"));
        format!("<Simulation: {} samples{score}{ended}>", self.inner.time.len())
    }

    /// The signals as a pandas DataFrame, a row per sample.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._frames")?.call_method1("simulation_frame", (slf,))
    }

    /// The same as an xarray Dataset over `time_s`, with units in `attrs`.
    fn to_xarray<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._frames")?.call_method1("dataset", (slf.call_method0("to_pandas")?,))
    }
}
