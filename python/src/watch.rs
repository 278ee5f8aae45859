//! Work in a separate thread, without Python's lock, while the calling thread checks for Ctrl-C and reports progress.

use crate::raised;
use crate::threads::with_threads;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

/// Interval between two checks: short enough that Ctrl-C seems to act at once.
const LOOK: Duration = Duration::from_millis(100);

/// Work without partial results is abandoned this long after Ctrl-C; its thread then ends on its own.
const PATIENCE: Duration = Duration::from_millis(500);

/// Progress that the work reports, and the request to stop.
#[derive(Default)]
pub struct Watch {
    stop: AtomicBool,
    /// Share of finished work, and the current step.
    told: Mutex<Option<(f64, String)>>,
}

impl Watch {
    /// Reports progress.
    pub fn tell(&self, done: f64, what: impl FnOnce() -> String) {
        if let Ok(mut told) = self.told.lock() {
            *told = Some((done, what()));
        }
    }

    /// True once the work must end.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Treatment of work on Ctrl-C.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum OnCtrlC {
    /// Wait for the partial result; a second Ctrl-C ends the wait.
    Keep,
    /// There is nothing to keep.
    Leave,
}

/// Runs the work. `progress` is called with the finished share and a text, several times a second. Ctrl-C or an exception of `progress`
/// stops the work; its result so far is returned with the exception.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    on_ctrl_c: OnCtrlC,
    work: impl FnOnce(&Watch) -> Result<T, leadlag::Error> + Send + 'static,
) -> PyResult<(T, Option<PyErr>)> {
    let watch = Arc::new(Watch::default());
    let (sender, receiver) = channel();
    let own = Arc::clone(&watch);
    let work = move || {
        let done = with_threads(|| work(&own));
        // The waiting thread may have given up.
        let _ = sender.send(());
        done
    };
    let worker = Builder::new().spawn(work).map_err(|error| PyRuntimeError::new_err(format!("no thread: {error}")))?;
    let (ended, exception) = py.detach(|| wait(receiver, &watch, progress, on_ctrl_c));
    if !ended {
        return Err(exception.unwrap_or_else(|| PyRuntimeError::new_err("the work was left")));
    }
    match (py.detach(|| joined(worker)), exception) {
        (Ok(found), exception) => Ok((found, exception)),
        // The work ended because of a request to stop.
        (Err(_), Some(exception)) => Err(exception),
        (Err(error), None) => Err(raised(error)),
    }
}

/// Runs work that reports nothing before it ends.
pub fn done<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, leadlag::Error> + Send + 'static,
) -> PyResult<T> {
    let (found, interrupted) = watched(py, None, OnCtrlC::Leave, move |_| work())?;
    interrupted.map_or(Ok(found), Err)
}

/// Waits for the end of the work; false if the work is abandoned first, with the exception that stopped it.
fn wait(
    receiver: Receiver<()>,
    watch: &Watch,
    progress: Option<&Py<PyAny>>,
    on_ctrl_c: OnCtrlC,
) -> (bool, Option<PyErr>) {
    let mut stopped: Option<(PyErr, Instant)> = None;
    while receiver.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
        let told = watch.told.lock().ok().and_then(|mut told| told.take());
        let looked = Python::attach(|py| {
            py.check_signals()?;
            match (progress, told) {
                (Some(progress), Some((done, what))) if stopped.is_none() => progress.call1(py, (done, what)).map(drop),
                _ => Ok(()),
            }
        });
        match (looked, &stopped) {
            (Ok(()), Some((_, since))) if on_ctrl_c == OnCtrlC::Leave && since.elapsed() > PATIENCE => {
                return (false, stopped.map(|(error, _)| error));
            }
            (Ok(()), _) => {}
            (Err(error), None) => {
                watch.stop.store(true, Ordering::Relaxed);
                stopped = Some((error, Instant::now()));
            }
            (Err(again), Some(_)) => return (false, Some(again)),
        }
    }
    (true, stopped.map(|(error, _)| error))
}

fn joined<T>(worker: JoinHandle<T>) -> T {
    worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}
