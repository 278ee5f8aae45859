//! Progress of a diagnosis, and its end on request.

use crate::calibrate::descent::Watch;
use crate::diagnose::question::{DiagnoseError, Progress};
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time between two questions to the caller: an answer may cost a lock of an interpreter.
const EVERY: Duration = Duration::from_millis(50);

/// Shows the stages to the caller, and ends the work of all threads soon after a request to stop.
pub struct Watching<'a>(Mutex<Inner<'a>>);

struct Inner<'a> {
    progress: &'a mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
    last: Progress,
    asked: Instant,
    stopped: bool,
}

impl Inner<'_> {
    fn ask(&mut self) {
        self.asked = Instant::now();
        self.stopped |= (self.progress)(self.last.clone()).is_break();
    }
}

impl<'a> Watching<'a> {
    /// Watches for the end that `progress` requests by a break.
    pub fn new(progress: &'a mut (dyn FnMut(Progress) -> ControlFlow<()> + Send)) -> Watching<'a> {
        let last = Progress { done: 0.0, stage: String::new() };
        Watching(Mutex::new(Inner { progress, last, asked: Instant::now(), stopped: false }))
    }

    /// Begins a stage; `done` is the share of the work before it.
    ///
    /// # Errors
    /// [`DiagnoseError::Stopped`] on request.
    pub fn show(&self, done: f64, stage: &str) -> Result<(), DiagnoseError> {
        let mut inner = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        inner.last = Progress { done, stage: stage.to_owned() };
        inner.ask();
        if inner.stopped { Err(DiagnoseError::Stopped) } else { Ok(()) }
    }

    /// Whether to continue.
    ///
    /// # Errors
    /// [`DiagnoseError::Stopped`] on request.
    pub fn go_on(&self) -> Result<(), DiagnoseError> {
        let mut inner = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if !inner.stopped && inner.asked.elapsed() >= EVERY {
            inner.ask();
        }
        if inner.stopped { Err(DiagnoseError::Stopped) } else { Ok(()) }
    }
}

impl Watch for &Watching<'_> {
    fn spend(&mut self, _: usize) -> bool {
        self.go_on().is_ok()
    }
}
