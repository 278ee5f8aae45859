//! The command line: one file per verb, with flags, library call and output.
//!
//! Results go to stdout, progress and warnings to stderr; exit 0 done, 1 failed, 2 wrong usage.

// All output to stderr here is progress, a hint or a warning, so `--quiet` is handled in one place: the modules below
// see this macro instead of the standard one.
macro_rules! eprintln {
    ($($text:tt)*) => {
        if !$crate::cli::output::is_quiet() {
            // A closed output is no reason to stop.
            let _ = ::std::io::Write::write_fmt(&mut ::std::io::stderr(), format_args!("{}\n", $crate::text::shown::lines(&::std::format!($($text)*))));
        }
    };
}

mod bench;
mod calibrate;
mod change;
mod check;
mod columns;
mod completions;
mod demo;
mod diagnose;
#[cfg(feature = "gpu")]
mod doctor;
mod evaluate;
mod evaluator;
mod export;
mod fleet_row;
mod folder;
mod inspect;
mod interrupt;
mod list;
mod man;
mod output;
mod plot;
mod progress;
mod report;
mod simulate;
mod study;
mod synth;

use crate::api::diagnosis::Found;
use crate::api::error::{Usage, is_usage};
use crate::api::{Drive, Error, Findings, Fit};
use anyhow::Context;
use clap::{CommandFactory, Parser, Subcommand};
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use std::sync::OnceLock;

const EXAMPLES: &str = "Examples:
  leadlag demo                # no data needed
  leadlag inspect drive.csv   # what a file holds
  leadlag calibrate drive.csv --follower 1 --model gipps+delay --out fit
  leadlag calibrate --help    # every verb has examples

Exit codes: 0 done, 1 failed, 2 wrong usage. Results go to stdout, all else to stderr.
All flags of a verb: leadlag VERB --help. Manual pages: leadlag man --out DIR.";

/// Widest lines of the help, which never exceeds the terminal; 80 if neither the terminal nor COLUMNS gives a width.
fn help_width() -> usize {
    let told = std::env::var("COLUMNS").is_ok_and(|text| text.parse::<usize>().is_ok());
    if told || terminal_size::terminal_size().is_some() { 100 } else { 80 }
}

/// Flags of every verb come last in its help.
const GLOBAL: &str = "Global options";

/// Calibrates and validates car-following and ACC models against measured trajectories.
#[derive(Debug, Parser)]
#[command(name = "leadlag", version, propagate_version = true, max_term_width = help_width(), after_help = EXAMPLES)]
struct Cli {
    /// Number of threads; results do not depend on it
    #[arg(long, global = true, help_heading = GLOBAL, value_name = "N", allow_negative_numbers = true,
          value_parser = crate::api::values::whole(1_u16, 1024))]
    threads: Option<u16>,
    /// Suppress progress, hints and warnings on stderr; errors still appear
    #[arg(short, long, global = true, help_heading = GLOBAL)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Show the contents of a measured file: vehicles, time spans, sampling, noise, missing samples, contradictions
    #[command(after_help = "Examples:
  leadlag inspect drive.csv
  leadlag inspect *.csv --json
  leadlag inspect trajectories.csv --columns ngsim")]
    Inspect(inspect::Args),
    /// Calibrate a variant against a measured follower
    #[command(after_help = "Examples:
  leadlag calibrate drive.csv --follower 1 --model gipps+delay --out fit
  leadlag calibrate a.csv b.csv --joint --model l-cth+linear --seed 7 --out fit
  leadlag calibrate drive.csv --model idm --fix v_0=33 --extend grade -o fit
  leadlag calibrate tracks.csv --columns highd --follower 24 --model idm -o fit")]
    Calibrate(Box<calibrate::Args>),
    /// Simulate a calibrated variant on a trajectory, or a whole platoon of them
    #[command(after_help = "Examples:
  leadlag simulate other.csv --follower 1 --result fit/result.json --out check
  leadlag simulate platoon.csv --platoon --result fit --out platoon")]
    Simulate(simulate::Args),
    /// Score the parameter vectors in the rows of a table
    #[command(after_help = "Examples:
  leadlag evaluate cases.csv --data folder --out scores.csv
  leadlag evaluate cases.csv --data folder --convention authors -o scores.csv")]
    Evaluate(evaluate::Args),
    /// Calibrate and validate many variants on many trajectories: plan, run, status, merge, report
    #[command(after_help = "Examples:
  leadlag study plan plan.toml --out study && leadlag study run study
  leadlag study merge study && leadlag study report study")]
    Study(study::Args),
    /// Check the data, find what a model lacks, and measure the gain of adding it
    Diagnose(Box<diagnose::Args>),
    /// Write a calibration, a study or a diagnosis as one HTML file
    Report(report::Args),
    /// Export a result to another program (SUMO)
    #[command(after_help = "Example:
  leadlag export sumo fit --no-run --out types")]
    Export(export::Args),
    /// Check your own extensions (WGSL files)
    Check(check::Args),
    /// List variants, parameters, causes, vehicles, goodness-of-fit functions, conventions, column maps
    #[command(after_help = "Examples:
  leadlag list variants
  leadlag list parameters --model 31 --vehicle bmw_x5
  leadlag list causes --json")]
    List(list::Args),
    /// Print a built-in column map, as a template for your own
    #[command(after_help = "Example:
  leadlag columns ngsim > mine.toml")]
    Columns(columns::Args),
    #[cfg(feature = "gpu")]
    /// List GPUs and drivers, with known problems
    #[command(after_help = "Examples:
  leadlag doctor
  leadlag doctor --json")]
    Doctor(doctor::Args),
    /// Measure how fast candidates are simulated
    #[command(after_help = "Examples:
  leadlag bench --quick
  leadlag bench --model idm --data drive.csv --follower 1 --json")]
    Bench(bench::Args),
    /// Generate a synthetic platoon of five cars with known parameters
    Synth(synth::Args),
    /// Plant an effect in a synthetic platoon and find it from the files alone; needs no data
    #[command(after_help = "Examples:
  leadlag demo --out demo
  leadlag demo --hide dead_zone --seed 3 --out demo")]
    Demo(demo::Args),
    /// Print a script that completes commands and flags in a shell
    Completions(completions::Args),
    /// Print the manual page, or write one per verb
    Man(man::Args),
}

/// The whole command line, to generate descriptions from.
fn command() -> clap::Command {
    Cli::command()
}

/// A finished command with a special exit code.
#[derive(Debug, thiserror::Error)]
#[error("exit code {0}")]
pub(crate) struct Exit(pub u8);

static GIVEN: OnceLock<String> = OnceLock::new();

/// The command; none if a program uses the library.
fn given() -> Option<String> {
    GIVEN.get().cloned()
}

/// Runs the command line of these words, of which the first is the name of the program. Results go to stdout, all else to stderr.
///
/// Returns the exit code: 0 done, 1 failed, 2 wrong usage; with `diagnose --exit-code` the verdict.
pub fn run<Word: Into<OsString> + Clone>(words: impl IntoIterator<Item = Word>) -> u8 {
    let words: Vec<OsString> = words.into_iter().map(Into::into).collect();
    let quoted = words.iter().skip(1).map(|word| demo::quoted(&word.to_string_lossy()));
    // If a process runs several commands, the first one counts.
    let _ = GIVEN.set(std::iter::once("leadlag".to_owned()).chain(quoted).collect::<Vec<_>>().join(" "));
    let cli = match Cli::try_parse_from(words) {
        Ok(cli) => cli,
        Err(error) => {
            // A closed output does not change the status.
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(1);
        }
    };
    let Err(error) = start(cli) else { return 0 };
    if output::is_broken_pipe(&error) {
        return 0;
    }
    if let Some(Exit(code)) = error.downcast_ref() {
        return *code;
    }
    let say = |line: String| drop(writeln!(std::io::stderr(), "{}", crate::text::shown::lines(&line)));
    say(format!("error: {error}"));
    // Does not repeat a cause that is already quoted.
    let said = error.to_string();
    let causes = error.chain().skip(1).map(ToString::to_string);
    causes.filter(|cause| !said.contains(cause.as_str())).for_each(|cause| say(format!("  because: {cause}")));
    if is_usage(&error) { 2 } else { 1 }
}

/// Writes the files of `calibrate --out` without the time: `result.json`, and per drive the simulation as table and picture.
///
/// # Errors
/// For a drive that lacks data of the model, or a folder that cannot be written.
pub fn save(fit: &Fit, drives: &[&Drive], folder: &Path) -> Result<(), Error> {
    let (loaded, cases) = fit.cases(drives)?;
    Ok(calibrate::write::files(folder, fit.result(), &cases, &loaded, None)?)
}

/// Writes the files of `diagnose --out`: `diagnosis.json`, tables and pictures.
///
/// # Errors
/// When the folder cannot be written.
pub fn save_findings(findings: &Findings, folder: &Path) -> Result<(), Error> {
    let written = match findings.found() {
        Found::OneCar(diagnosis, [train, holdout]) => diagnose::write::files(folder, diagnosis, train, holdout),
        Found::Fleet(outcome) => diagnose::write::of_fleet(folder, outcome),
    };
    Ok(written?)
}

/// Writes the tables of `study merge`.
///
/// # Errors
/// If tasks are missing, or parts contradict each other.
pub fn merge(study: &Path) -> Result<(), Error> {
    let of = study::status::Place { folder: study.to_owned(), parts: Vec::new() };
    Ok(study::merge::tables(&of, false, None).map(drop)?)
}

/// The page that `report` makes of the main file of a folder: `result.json`, `diagnosis.json`, `fleet.json` or `tasks.jsonl`.
///
/// # Errors
/// For any other file.
pub fn page(file: &Path) -> Result<String, Error> {
    Ok(report::page(file)?)
}

/// Starts the threads and runs one command.
fn start(cli: Cli) -> anyhow::Result<()> {
    // Start them now, because a failure at their first use would be a panic.
    rayon::ThreadPoolBuilder::new().num_threads(cli.threads.map_or(0, usize::from)).build_global().context(
        "cannot start the threads: ask for fewer with --threads N, or allow this process more threads or memory (`ulimit -u`, \
         `ulimit -v`)",
    )?;
    nested(cli)
}

/// The same if the threads are running already: a command within another one.
fn nested(cli: Cli) -> anyhow::Result<()> {
    output::set_quiet(cli.quiet);
    match cli.command {
        Command::Inspect(args) => inspect::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Diagnose(args) => diagnose::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Columns(args) => columns::run(&args),
        Command::List(args) => list::run(&args),
        #[cfg(feature = "gpu")]
        Command::Doctor(args) => doctor::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Synth(args) => synth::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
    }
}
