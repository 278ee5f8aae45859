//! Long work: in a thread of its own, without Python's lock, while the calling thread listens to Ctrl-C and tells how far it is.

use crate::raised;
use pyo3::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Between two looks: short enough that Ctrl-C seems to act at once.
const LOOK: Duration = Duration::from_millis(100);

/// What the work tells, and what it is told.
#[derive(Default)]
pub struct Watch {
    stop: AtomicBool,
    /// Share that is done, and what is being done.
    told: Mutex<Option<(f64, String)>>,
}

impl Watch {
    /// Tells how far the work is.
    pub fn tell(&self, done: f64, what: impl FnOnce() -> String) {
        if let Ok(mut told) = self.told.lock() {
            *told = Some((done, what()));
        }
    }

    /// True once the work is to end.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Does the work. `progress` is called with the share that is done and a text, some times a second. Ctrl-C, or an exception of `progress`, stops the
/// work; what it found so far comes back with the exception.
pub fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Watch) -> Result<T, leadlag::Error> + Send,
) -> PyResult<(T, Option<PyErr>)> {
    let watch = Watch::default();
    let mut exception = None;
    let done = py.detach(|| {
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            let watch = &watch;
            let worker = scope.spawn(move || {
                let done = work(watch);
                // Whoever waits may have given up.
                let _ = sender.send(());
                done
            });
            while receiver.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if exception.is_some() {
                    continue;
                }
                let told = watch.told.lock().ok().and_then(|mut told| told.take());
                let looked = Python::attach(|py| {
                    py.check_signals()?;
                    match (progress, told) {
                        (Some(progress), Some((done, what))) => progress.call1(py, (done, what)).map(drop),
                        _ => Ok(()),
                    }
                });
                if let Err(error) = looked {
                    exception = Some(error);
                    watch.stop.store(true, Ordering::Relaxed);
                }
            }
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    });
    match (done, exception) {
        (Ok(found), exception) => Ok((found, exception)),
        // The work ended because it was told to.
        (Err(_), Some(exception)) => Err(exception),
        (Err(error), None) => Err(raised(error)),
    }
}
