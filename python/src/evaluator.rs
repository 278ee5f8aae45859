//! Scores of many candidates.

use crate::threads::{GPU, with_threads};
use crate::{UsageError, raised};
use numpy::ndarray::{Array2, Array3, s};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Number of candidates between two checks for Ctrl-C, so that they take about this long.
const LOOK: Duration = Duration::from_millis(200);

/// Number of candidates in the first part, and the largest factor from one part to the next.
const FIRST: usize = 8;
const GROWTH: usize = 8;

/// Scores candidates of one model on one or several drives.
#[pyclass(module = "leadlag", frozen)]
pub struct Evaluator {
    inner: Mutex<leadlag::Evaluator>,
    samples: Vec<usize>,
    /// Candidates of a part, for scores, simulations, residuals and normal equations.
    parts: [AtomicUsize; 4],
}

type Signals<'py> = [Bound<'py, PyArray2<f64>>; 3];
type Equations<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

impl Evaluator {
    pub fn of(inner: leadlag::Evaluator, drives: &[leadlag::Drive]) -> Evaluator {
        let samples = drives.iter().map(leadlag::Drive::len).collect();
        Evaluator { inner: Mutex::new(inner), samples, parts: [FIRST; 4].map(AtomicUsize::new) }
    }

    fn with<T>(&self, read: impl FnOnce(&mut leadlag::Evaluator) -> T) -> T {
        read(&mut self.inner.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Does the same with parts of the candidates, between which Ctrl-C ends the call. The result does not depend on the parts.
    fn in_parts<T: Send>(
        &self,
        x: &PyReadonlyArray2<'_, f64>,
        part: &AtomicUsize,
        work: impl Fn(&mut leadlag::Evaluator, &[f64]) -> Result<Vec<T>, leadlag::Error> + Sync,
    ) -> PyResult<Vec<T>> {
        let py = x.py();
        if self.device().starts_with("gpu") && GPU.is_elsewhere() {
            let message = "the evaluator is on a GPU, which a forked process does not have; use \
                           multiprocessing.get_context(\"spawn\"), or make the evaluator in the process, where it takes the CPU";
            return Err(UsageError::new_err(message));
        }
        let array = x.as_array();
        let whole = array.as_standard_layout();
        let mut rest = whole.as_slice().expect("in standard layout it is one slice");
        let mut found = Vec::with_capacity(array.nrows());
        while !rest.is_empty() {
            let candidates = part.load(Ordering::Relaxed);
            let (now, later) = rest.split_at(rest.len().min(candidates * array.ncols()));
            let started = Instant::now();
            found.extend(py.detach(|| with_threads(|| self.with(|inner| work(inner, now)))).map_err(raised)?);
            py.check_signals()?;
            if !later.is_empty() {
                let wanted = LOOK.as_secs_f64() / started.elapsed().as_secs_f64().max(1e-9) * candidates as f64;
                part.store((wanted as usize).clamp(1, GROWTH * candidates), Ordering::Relaxed);
            }
            rest = later;
        }
        Ok(found)
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

    /// Scores of the rows of an array, which is read in place if it is contiguous.
    fn scores<'py>(&self, x: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let scores = self.in_parts(&x, &self.parts[0], leadlag::Evaluator::scores)?;
        Ok(PyArray1::from_vec(x.py(), scores))
    }

    /// Simulated spacing, speed and acceleration of the rows of an array on one drive; NaN behind the end of a run.
    fn simulate<'py>(&self, x: PyReadonlyArray2<'py, f64>, drive: usize) -> PyResult<Signals<'py>> {
        let Some(&samples) = self.samples.get(drive) else {
            let message = format!("drive {drive}: expected 0 to {}", self.samples.len() - 1);
            return Err(UsageError::new_err(message));
        };
        let runs = self.in_parts(&x, &self.parts[1], |inner, candidates| inner.simulate(candidates, drive))?;
        Ok([0, 1, 2].map(|signal| {
            let mut all = Array2::from_elem((runs.len(), samples), f64::NAN);
            for (row, run) in runs.iter().enumerate() {
                let values = &run[signal];
                all.slice_mut(s![row, ..values.len()]).iter_mut().zip(values).for_each(|(to, from)| *to = *from);
            }
            all.to_pyarray(x.py())
        }))
    }

    /// Residuals of the rows of an array, whose squares add up to the scores.
    fn residuals<'py>(&self, x: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rows = self.in_parts(&x, &self.parts[2], |inner, candidates| inner.residuals(candidates))?;
        let mut all = Array2::zeros((rows.len(), 3 * self.samples.iter().sum::<usize>()));
        for (mut to, from) in all.rows_mut().into_iter().zip(rows) {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = from);
        }
        Ok(all.into_pyarray(x.py()))
    }

    /// The normal equations of these residuals.
    fn normal_equations<'py>(&self, x: PyReadonlyArray2<'py, f64>) -> PyResult<Equations<'py>> {
        let rows = self.in_parts(&x, &self.parts[3], leadlag::Evaluator::normal_equations)?;
        let (n, p) = (rows.len(), x.as_array().ncols());
        let jtj = Array3::from_shape_fn((n, p, p), |(i, a, b)| rows[i].jtj[a * p + b]);
        let jtr = Array2::from_shape_fn((n, p), |(i, a)| rows[i].jtr[a]);
        let rtr = rows.iter().map(|row| row.rtr).collect();
        Ok((jtj.into_pyarray(x.py()), jtr.into_pyarray(x.py()), PyArray1::from_vec(x.py(), rtr)))
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
