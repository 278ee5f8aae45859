//! One file per verb: flags, library call, output.
//!
//! Results go to stdout, progress and warnings to stderr; exit 0 done, 1 failed, 2 wrong usage.

mod bench;
mod calibrate;
mod check;
mod data;
mod demo;
mod diagnose;
mod doctor;
mod evaluate;
mod evaluator;
mod extension;
mod inspect;
mod interrupt;
mod list;
pub mod output;
mod report;
mod simulate;
mod study;
mod synth;

use clap::{Parser, Subcommand};
use leadlag::calibrate::BoundsError;
use leadlag::trajectory::PrepareError;
use leadlag::vehicle::VehicleError;

/// Calibrates and validates car-following and ACC models against measured trajectories.
#[derive(Debug, Parser)]
#[command(name = "leadlag", version, propagate_version = true, max_term_width = 100)]
pub struct Cli {
    /// Number of threads; results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Show what a measured file contains: vehicles, spans, sampling, noise, gaps, contradictions
    Inspect(inspect::Args),
    /// Calibrate a variant against a measured follower
    Calibrate(Box<calibrate::Args>),
    /// Simulate a calibrated variant on a trajectory, or a whole platoon of them
    Simulate(simulate::Args),
    /// Score parameter vectors that are given as rows of a table
    Evaluate(evaluate::Args),
    /// Calibrate and validate many variants on many trajectories: plan, run, status, merge
    Study(study::Args),
    /// Show what the data and a simulation get wrong, name the cause, and measure what it is worth
    Diagnose(Box<diagnose::Args>),
    /// Write a calibration or a diagnosis as one HTML file
    Report(report::Args),
    /// Check extensions of one's own: WGSL files
    Check(check::Args),
    /// List variants, parameters, causes, vehicles, goodness-of-fit functions, conventions, column maps
    List(list::Args),
    /// Show which GPUs and drivers there are, and what to mind with them
    Doctor(doctor::Args),
    /// Measure how fast candidates are simulated
    Bench(bench::Args),
    /// Write a synthetic five-car platoon whose truth is known
    Synth(synth::Args),
    /// Make a synthetic platoon, inspect it, calibrate a variant on it: no data needed
    Demo(demo::Args),
}

/// Wrong usage that the argument parser cannot see.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// A command that was done, and whose exit code says more.
#[derive(Debug, thiserror::Error)]
#[error("exit code {0}")]
pub struct Exit(pub u8);

/// True if the command line itself asked for something that cannot be, whatever the data.
pub fn is_usage(error: &anyhow::Error) -> bool {
    let bounds = |e: &BoundsError| !matches!(e, BoundsError::Read { .. });
    error.is::<Usage>()
        || error.downcast_ref().is_some_and(bounds)
        || error.downcast_ref().is_some_and(study::is_usage)
        || error.downcast_ref().is_some_and(|e| matches!(e, VehicleError::Unknown { .. }))
        || error.downcast_ref().is_some_and(|e| {
            use PrepareError::{NoFollower, NoTrajectory, Option};
            matches!(e, Option { .. } | NoFollower { .. } | NoTrajectory { .. })
        })
}

/// Runs one command.
pub fn run(cli: Cli) -> anyhow::Result<()> {
    if let Some(threads) = cli.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
    }
    match cli.command {
        Command::Inspect(args) => inspect::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Diagnose(args) => diagnose::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Check(args) => check::run(&args),
        Command::List(args) => list::run(&args),
        Command::Doctor(args) => doctor::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Synth(args) => synth::run(&args),
        Command::Demo(args) => demo::run(&args),
    }
}
