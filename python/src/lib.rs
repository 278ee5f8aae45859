//! The extension module `leadlag._native`: the API of the library as Python classes. Features of Python, such as data frames and pictures,
//! are in the Python files beside it.

mod drive;
mod evaluator;
mod findings;
mod fit;
mod model;
mod reading;
mod study;
mod threads;
mod watch;

use leadlag::internal::text::option::{Opt, flag, in_file, word_options};
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

create_exception!(leadlag, Error, PyException, "A failure: place, expected value, found value, remedy.");
create_exception!(leadlag, UsageError, Error, "An invalid request, whatever the data.");

/// An error of the library as a Python exception with the same text.
fn raised(error: leadlag::Error) -> PyErr {
    let text = error.to_string();
    if error.is_usage() { UsageError::new_err(text) } else { Error::new_err(text) }
}

/// How messages name an option here: by its keyword.
fn keyword(option: Opt) -> String {
    if COMMANDS.load(Ordering::Relaxed) > 0 {
        return flag(option);
    }
    let id = option.id();
    let word = match id.as_str() {
        "from" => "start".to_owned(),
        "to" => "end".to_owned(),
        "evaluator" | "gpu" => "device".to_owned(),
        "extend" => "Model(extend=...)".to_owned(),
        _ => id,
    };
    // Otherwise `to` or `data` would look like a word of the sentence.
    format!("`{word}`")
}

/// Commands that run in this process; their messages name flags.
static COMMANDS: AtomicUsize = AtomicUsize::new(0);

/// A command that runs, to its end or its panic.
struct Running;

impl Running {
    fn begin() -> Running {
        COMMANDS.fetch_add(1, Ordering::Relaxed);
        Running
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        COMMANDS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Runs the command line with these words, the first of which is the name of the program; returns the exit code.
#[pyfunction]
fn run(py: Python<'_>, words: Vec<String>) -> u8 {
    // Its threads are those of this process.
    threads::POOL.is_elsewhere();
    let _running = Running::begin();
    py.detach(|| leadlag::cli::run(words))
}

/// The page for the main file of a folder that `save` wrote.
#[pyfunction]
fn page(py: Python<'_>, file: PathBuf) -> PyResult<String> {
    watch::done(py, move || in_file(|| leadlag::cli::page(&file)))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    word_options(keyword);
    module.add_class::<drive::Drive>()?;
    module.add_class::<fit::Fit>()?;
    module.add_class::<fit::Simulation>()?;
    module.add_class::<evaluator::Evaluator>()?;
    module.add_class::<findings::Findings>()?;
    module.add_class::<model::Calibration>()?;
    module.add_function(wrap_pyfunction!(run, module)?)?;
    module.add_function(wrap_pyfunction!(page, module)?)?;
    module.add_function(wrap_pyfunction!(drive::read, module)?)?;
    module.add_function(wrap_pyfunction!(drive::again, module)?)?;
    module.add_function(wrap_pyfunction!(drive::synthetic, module)?)?;
    module.add_class::<model::Pairs>()?;
    module.add_function(wrap_pyfunction!(model::pairs_of_files, module)?)?;
    module.add_function(wrap_pyfunction!(model::pairs_of_drives, module)?)?;
    module.add_function(wrap_pyfunction!(model::calibrate_pairs, module)?)?;
    module.add_function(wrap_pyfunction!(study::plan_study, module)?)?;
    module.add_function(wrap_pyfunction!(study::run_study, module)?)?;
    module.add_function(wrap_pyfunction!(study::merge_study, module)?)?;
    module.add_function(wrap_pyfunction!(study::trajectories, module)?)?;
    module.add_function(wrap_pyfunction!(findings::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(findings::diagnose_pairs, module)?)?;
    module.add("Error", module.py().get_type::<Error>())?;
    module.add("UsageError", module.py().get_type::<UsageError>())?;
    module.add("READING", reading::names())?;
    module.add("EVALUATIONS_PER_PARAMETER", leadlag::internal::fleet::EVALUATIONS_PER_PARAMETER)?;
    module.add("PROGRAM", leadlag::program())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
