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

use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use std::path::PathBuf;

create_exception!(leadlag, Error, PyException, "A failure: place, expected value, found value, remedy.");
create_exception!(leadlag, UsageError, Error, "An invalid request, whatever the data.");

/// An error of the library as a Python exception with the same text.
fn raised(error: leadlag::Error) -> PyErr {
    let text = in_keywords(&error.to_string());
    if error.is_usage() { UsageError::new_err(text) } else { Error::new_err(text) }
}

/// Flags of the command line with another name in Python; the others differ only in the dashes.
const RENAMED: [(&str, &str); 5] =
    [("from", "start"), ("to", "end"), ("evaluator", "device"), ("extend", "Model(extend=...)"), ("gpu", "device")];

/// Values of flags that messages name.
const VALUES: [&str; 13] = [
    "acc",
    "auto",
    "compensated",
    "f64",
    "gpu",
    "human",
    "lanes",
    "level",
    "nrmse-s",
    "plain",
    "reference",
    "spacing",
    "speeds",
];

/// A message of the command line in terms of Python: `--max-gap` becomes `max_gap`, and `--gof nrmse-s` becomes `gof="nrmse-s"`. A command
/// in backticks stays unchanged.
fn in_keywords(text: &str) -> String {
    let mut told = String::with_capacity(text.len());
    for (k, part) in text.split('`').enumerate() {
        if k > 0 {
            told.push('`');
        }
        if k % 2 == 1 {
            told += part;
            continue;
        }
        let mut pieces = part.split("--");
        told += pieces.next().unwrap_or_default();
        for piece in pieces {
            let end = piece.find(|c: char| !(c.is_ascii_lowercase() || c == '-')).unwrap_or(piece.len());
            let (name, rest) = piece.split_at(end);
            let renamed = RENAMED.iter().find(|(flag, _)| *flag == name).map(|(_, keyword)| (*keyword).to_owned());
            told += &renamed.unwrap_or_else(|| name.replace('-', "_"));
            let word = rest.strip_prefix(' ').unwrap_or_default();
            let end = word.find(|c: char| !(c.is_ascii_alphanumeric() || c == '-')).unwrap_or(word.len());
            if VALUES.contains(&&word[..end]) {
                told += &format!("=\"{}\"{}", &word[..end], &word[end..]);
            } else {
                told += rest;
            }
        }
    }
    told
}

/// The same for Python.
#[pyfunction]
#[pyo3(name = "_in_keywords")]
fn to_keywords(text: &str) -> String {
    in_keywords(text)
}

/// Runs the command line with these words, the first of which is the name of the program; returns the exit code.
#[pyfunction]
fn run(py: Python<'_>, words: Vec<String>) -> u8 {
    // Its threads are those of this process.
    threads::POOL.is_elsewhere();
    py.detach(|| leadlag::cli::run(words))
}

/// The page for the main file of a folder that `save` wrote.
#[pyfunction]
fn page(py: Python<'_>, file: PathBuf) -> PyResult<String> {
    watch::done(py, move || leadlag::cli::page(&file))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<drive::Drive>()?;
    module.add_class::<fit::Fit>()?;
    module.add_class::<fit::Simulation>()?;
    module.add_class::<evaluator::Evaluator>()?;
    module.add_class::<findings::Findings>()?;
    module.add_class::<model::Calibration>()?;
    module.add_function(wrap_pyfunction!(run, module)?)?;
    module.add_function(wrap_pyfunction!(to_keywords, module)?)?;
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
