//! Scores of many candidates.

use crate::raised;
use numpy::ndarray::{Array2, s};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Scores candidates of one model on one or several drives.
#[pyclass(module = "leadlag", frozen)]
pub struct Evaluator {
    inner: Mutex<leadlag::Evaluator>,
    samples: Vec<usize>,
}

type Signals<'py> = [Bound<'py, PyArray2<f64>>; 3];

impl Evaluator {
    pub fn of(inner: leadlag::Evaluator, drives: &[leadlag::Drive]) -> Evaluator {
        let samples = drives.iter().map(leadlag::Drive::len).collect();
        Evaluator { inner: Mutex::new(inner), samples }
    }

    fn with<T>(&self, read: impl FnOnce(&mut leadlag::Evaluator) -> T) -> T {
        read(&mut self.inner.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[pymethods]
impl Evaluator {
    #[getter]
    fn parameters(&self) -> Vec<&'static str> {
        self.with(|inner| inner.parameters())
    }

    #[getter]
    fn units(&self) -> Vec<&'static str> {
        self.with(|inner| inner.units())
    }

    #[getter]
    fn lower<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.with(|inner| inner.lower()))
    }

    #[getter]
    fn upper<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.with(|inner| inner.upper()))
    }

    #[getter]
    fn device(&self) -> String {
        self.with(|inner| inner.device())
    }

    /// Scores of the rows of an array, which is read in place where it is contiguous.
    fn scores<'py>(&self, py: Python<'py>, x: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let array = x.as_array();
        let whole = array.as_standard_layout();
        let candidates = whole.as_slice().expect("in standard layout it is one slice");
        let scores = py.detach(|| self.with(|inner| inner.scores(candidates))).map_err(raised)?;
        Ok(PyArray1::from_vec(py, scores))
    }

    /// Simulated spacing, speed and acceleration of the rows of an array on one drive; NaN behind the end of a run.
    fn simulate<'py>(&self, py: Python<'py>, x: PyReadonlyArray2<'py, f64>, drive: usize) -> PyResult<Signals<'py>> {
        let Some(&samples) = self.samples.get(drive) else {
            let message = format!("drive {drive}: expected 0 to {}", self.samples.len() - 1);
            return Err(crate::UsageError::new_err(message));
        };
        let array = x.as_array();
        let whole = array.as_standard_layout();
        let candidates = whole.as_slice().expect("in standard layout it is one slice");
        let runs = py.detach(|| self.with(|inner| inner.simulate(candidates, drive))).map_err(raised)?;
        Ok([0, 1, 2].map(|signal| {
            let mut all = Array2::from_elem((runs.len(), samples), f64::NAN);
            for (row, run) in runs.iter().enumerate() {
                let values = &run[signal];
                all.slice_mut(s![row, ..values.len()]).iter_mut().zip(values).for_each(|(to, from)| *to = *from);
            }
            all.to_pyarray(py)
        }))
    }

    fn __repr__(&self) -> String {
        let parameters = self.parameters().join(", ");
        let drives = match self.samples.len() {
            1 => "1 drive".to_owned(),
            several => format!("{several} drives"),
        };
        format!("<Evaluator of ({parameters}) on {drives}: {}>", self.device())
    }
}
