//! Scoring parameter vectors in the rows of a table: in order, in bounded memory, bad rows marked.

mod batch;
mod library;
mod row;

pub use library::{DataLayout, Library, OpenError};

use crate::convention::Convention;
use crate::evaluator::{Case, EvaluateError, Evaluator, Outcome};
use crate::score::{GoodnessOfFit, Measures};
use crate::text::option::DATA;
use batch::Batch;
use csv::ByteRecord;
use row::{Columns, Task, parse};
use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::time::{Duration, Instant};

/// Number of rows in memory at a time: it grows as long as they take less than a second.
const FIRST_CHUNK: usize = 1024;
const MAX_CHUNK: usize = 65_536;

/// How rows are scored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    pub convention: Convention,
    /// Upper bound of the perception delay \[s\]: fixes the scored window of variants with delay.
    pub tau_p_upper: f64,
    /// Add the f64 value of NRMSE(s,v,a) as a separate column.
    pub rescore: bool,
}

/// Numbers of rows by outcome.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Summary {
    /// Rows read.
    pub rows: u64,
    /// Runs that ended early.
    pub failed: u64,
    /// Rows that could not be simulated.
    pub invalid: u64,
    /// Number (from 1) and reason of the first of them.
    pub first_invalid: Option<(u64, String)>,
    /// Rows with parameters that their variant does not have.
    pub with_unused: u64,
    /// Those parameters.
    pub unused: BTreeSet<&'static str>,
}

impl Summary {
    fn count(&mut self, result: &Result<Computed, String>) {
        self.rows += 1;
        match result {
            Ok(computed) => self.failed += u64::from(computed.outcome.result.is_err()),
            Err(reason) => {
                self.invalid += 1;
                self.first_invalid.get_or_insert_with(|| (self.rows, reason.clone()));
            }
        }
    }
}

/// A table that cannot be evaluated at all.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    #[error("{path}: cannot read the cases")]
    Read { path: String, source: csv::Error },
    #[error("{path}:1: expected at most {most} columns, found {found}; is this the table of cases?")]
    Wide { path: String, most: usize, found: usize },
    #[error("{path}:1: column {missing} is missing; the file has {} (needed: model_id or variant, follower_position, and platoon or file unless {DATA} is one file; separated by commas)", if found.is_empty() { "nothing".to_owned() } else { found.join(", ") })]
    Column { path: String, missing: &'static str, found: Vec<String> },
    #[error("{path}:1: column {column} occurs more than once; remove or rename one")]
    Twice { path: String, column: &'static str },
    #[error("cannot write the results")]
    Write(#[source] csv::Error),
    #[error("cannot evaluate the rows")]
    Evaluate(#[from] EvaluateError),
    #[error("interrupted after {0} rows; the output is complete up to there")]
    Interrupted(u64),
}

/// Makes the evaluator of some cases of one variant.
pub type Build<'a> = dyn FnMut(Vec<Case>) -> Result<Box<dyn Evaluator>, EvaluateError> + 'a;

/// Evaluates a table: all input columns, then the outcome, row by row.
///
/// `path` names the input in messages. `build` makes the evaluators, one per variant. `progress` receives the number of finished rows and may stop
/// the work by returning false. Fails if the input lacks required columns, or reading or writing fails. A bad row is marked and is not an error.
pub fn evaluate_table(
    input: impl Read,
    path: &str,
    output: impl Write,
    library: &mut Library,
    settings: &Settings,
    build: &mut Build,
    progress: &mut dyn FnMut(u64) -> bool,
) -> Result<Summary, TableError> {
    let read_error = |source| TableError::Read { path: path.to_owned(), source };
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(input);
    let headers = reader.byte_headers().map_err(read_error)?.clone();
    let columns = Columns::find(&headers, path, library.is_one_file())?;
    let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(output);
    writer.write_byte_record(&output_headers(&headers, settings)).map_err(TableError::Write)?;

    let mut summary = Summary::default();
    let mut records = Vec::new();
    let (mut batch, mut chunk) = (Batch::default(), FIRST_CHUNK);
    loop {
        records.clear();
        let mut record = ByteRecord::new();
        while records.len() < chunk && reader.read_byte_record(&mut record).map_err(read_error)? {
            records.push(std::mem::take(&mut record));
        }
        if records.is_empty() {
            break;
        }
        let started = Instant::now();
        let tasks: Vec<Task> = records.iter().map(|r| parse(r, &columns, library, settings)).collect();
        for (record, task) in records.iter().zip(&tasks) {
            let unused = task.as_ref().map_or(Vec::new(), |(case, _)| columns.unused(record, &case.variant));
            summary.with_unused += u64::from(!unused.is_empty());
            summary.unused.extend(unused);
        }
        let results = batch.run(tasks, settings.rescore, build)?;
        if started.elapsed() < Duration::from_secs(1) {
            chunk = MAX_CHUNK.min(2 * chunk);
        }
        for (record, result) in records.iter().zip(&results) {
            summary.count(result);
            writer
                .write_byte_record(&output_row(record, headers.len(), result, settings))
                .map_err(TableError::Write)?;
        }
        writer.flush().map_err(|e| TableError::Write(e.into()))?;
        if !progress(summary.rows) {
            return Err(TableError::Interrupted(summary.rows));
        }
    }
    Ok(summary)
}

/// Names of the outcome columns.
fn outcome_headers(settings: &Settings) -> Vec<&'static str> {
    let mut names = vec!["success", "fail_reason", "fail_step", "delay_steps", "n_cut_acc", "n_cut_dec"];
    names.extend(Measures::NAMES);
    names.extend(["calib_cost", "evaluator", "precision"]);
    if settings.rescore {
        names.push("nrmse_sva_f64");
    }
    names
}

/// The input's columns, then the outcome's. An input column with the name of an outcome gets `_in` as a suffix, repeated until its name is
/// unique.
fn output_headers(headers: &ByteRecord, settings: &Settings) -> ByteRecord {
    let outcomes: Vec<&[u8]> = outcome_headers(settings).into_iter().map(str::as_bytes).collect();
    let mut names: Vec<Vec<u8>> = headers.iter().map(<[u8]>::to_vec).collect();
    for k in 0..names.len() {
        let mut name = names[k].clone();
        if outcomes.contains(&name.as_slice()) {
            while outcomes.contains(&name.as_slice()) || names.contains(&name) {
                name.extend(b"_in");
            }
            names[k] = name;
        }
    }
    names.extend(outcomes.into_iter().map(<[u8]>::to_vec));
    names.into()
}

/// Content of a row, and its evaluator.
#[derive(Debug, Clone)]
struct Computed {
    outcome: Outcome,
    evaluator: &'static str,
    precision: &'static str,
    /// NRMSE(s,v,a) by the f64 reference, if it was requested and the run reaches its end there.
    rescored: Option<f64>,
}

fn output_row(record: &ByteRecord, width: usize, result: &Result<Computed, String>, settings: &Settings) -> ByteRecord {
    let mut row: ByteRecord = (0..width).map(|i| record.get(i).unwrap_or_default()).collect::<Vec<_>>().into();
    let mut push = |text: &str| row.push_field(text.as_bytes());
    let measures = match result {
        Ok(Computed { outcome, .. }) => {
            match outcome.result {
                Ok(_) => ["1", "", ""].into_iter().for_each(&mut push),
                Err(failure) => {
                    ["0", failure.kind.into_str(), &failure.step.to_string()].into_iter().for_each(&mut push)
                }
            };
            push(&float(outcome.delay_steps));
            push(&outcome.n_cut_acc.to_string());
            push(&outcome.n_cut_dec.to_string());
            outcome.result.ok()
        }
        Err(reason) => {
            ["0", &format!("invalid: {reason}"), "", "", "", ""].into_iter().for_each(&mut push);
            None
        }
    };
    let rejected = result.as_ref().is_ok_and(|computed| computed.outcome.is_rejected(settings.convention.bounds));
    let nrmse_sva = measures.map(|m| GoodnessOfFit::NRMSE_SVA.of(&m));
    match measures {
        Some(measures) => measures.values().iter().for_each(|v| push(&float(*v))),
        None => Measures::NAMES.iter().for_each(|_| push("")),
    }
    push(&nrmse_sva.filter(|_| !rejected).map_or(String::new(), float));
    let computed = result.as_ref().ok();
    push(computed.map_or("", |c| c.evaluator));
    push(computed.map_or("", |c| c.precision));
    if settings.rescore {
        push(&computed.and_then(|c| c.rescored).map_or(String::new(), float));
    }
    row
}

/// Shortest text that reads back as the same number; NaN (a measure that does not exist) is empty.
fn float(x: f64) -> String {
    if x.is_nan() {
        String::new()
    } else if x.fract() == 0.0 && x.abs() < 1e15 {
        format!("{x:.0}")
    } else {
        format!("{x:?}")
    }
}
