//! What a calibration found.

use crate::drive::{Drive, warn};
use crate::raised;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Calibrated parameters with what is known of them.
#[pyclass(module = "leadlag", frozen)]
pub struct Fit {
    inner: leadlag::Fit,
    drives: Vec<leadlag::Drive>,
    /// The same, as Python has them.
    own: Vec<Py<Drive>>,
}

impl Fit {
    pub fn of(inner: leadlag::Fit, drives: Vec<leadlag::Drive>, own: Vec<Py<Drive>>) -> Fit {
        Fit { inner, drives, own }
    }

    fn refs(&self) -> Vec<&leadlag::Drive> {
        self.drives.iter().collect()
    }
}

/// What pickles: a constructor, and what it is called with.
type Reduced = (Py<PyAny>, (String, Vec<Py<Drive>>));

#[pymethods]
impl Fit {
    /// Of the text of a result.json, on these drives.
    #[staticmethod]
    fn of_json(text: &str, drives: Vec<Py<Drive>>) -> PyResult<Fit> {
        let inner = leadlag::Fit::from_json(text).map_err(raised)?;
        let plain = drives.iter().map(|drive| drive.get().inner.clone()).collect();
        Ok(Fit { inner, drives: plain, own: drives })
    }

    #[getter]
    fn drives(&self, py: Python<'_>) -> Vec<Py<Drive>> {
        self.own.iter().map(|drive| drive.clone_ref(py)).collect()
    }

    #[getter]
    fn model(&self) -> String {
        self.inner.model()
    }

    #[getter]
    fn score(&self) -> f64 {
        self.inner.score()
    }

    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.inner.parameters().iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
        Ok(dict)
    }

    #[getter]
    fn intervals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.inner.intervals().iter().try_for_each(|(name, [lower, upper])| dict.set_item(name, (lower, upper)))?;
        Ok(dict)
    }

    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.inner.units().iter().try_for_each(|(name, unit)| dict.set_item(name, unit))?;
        Ok(dict)
    }

    #[getter]
    fn at_bound(&self) -> Vec<String> {
        self.inner.at_bound().to_vec()
    }

    fn to_json(&self) -> String {
        self.inner.to_json()
    }

    fn simulate(&self, py: Python<'_>, drive: &Drive) -> PyResult<Simulation> {
        let inner = py.detach(|| self.inner.simulate(&drive.inner)).map_err(raised)?;
        warn(py, &inner.warnings)?;
        Ok(Simulation { inner })
    }

    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| leadlag::cli::save(&self.inner, &self.refs(), &folder)).map_err(raised)
    }

    /// The HTML report: written to a file where a path is given, else shown in a notebook.
    #[pyo3(signature = (path=None))]
    fn report<'py>(slf: &Bound<'py, Self>, path: Option<PathBuf>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._show")?.call_method1("report", (slf, "result.json", path))
    }

    /// Measured and simulated signals over time, drawn by matplotlib; the figure comes back.
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
        let make = slf.py().import("leadlag._native")?.getattr("Fit")?.getattr("of_json")?;
        Ok((make.unbind(), (slf.to_json(), slf.drives(slf.py()))))
    }
}

/// A run of a calibrated model on a drive.
#[pyclass(module = "leadlag", frozen)]
pub struct Simulation {
    inner: leadlag::Simulation,
}

#[pymethods]
impl Simulation {
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.time)
    }

    #[getter]
    fn spacing<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.spacing)
    }

    #[getter]
    fn speed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.speed)
    }

    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.inner.acceleration)
    }

    #[getter]
    fn scores<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.inner.scores.iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
        Ok(dict)
    }

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

    /// The table of the simulation as a pandas DataFrame.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("leadlag._frames")?.call_method1("simulation_frame", (slf,))
    }
}
