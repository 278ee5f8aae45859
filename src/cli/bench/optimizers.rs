//! `leadlag bench optimizers`: quality of an optimiser.

use super::super::{interrupt, output};
use super::with_bar;
use crate::bench::{OptimizerOutcome, OptimizerReport, OptimizerTask, optimizer_tasks, run_optimizers};
use crate::calibrate::OptimizerKind;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Five seeds of each ten and twelve surfaces, instead of all seeds and ninety variants on twelve followers
    #[arg(long)]
    quick: bool,
    /// auto, ga, lshade or cmaes
    #[arg(long, default_value = "auto")]
    optimizer: OptimizerKind,
    /// Folder with data/astazero_c2art and data/vehicles [default: LEADLAG_SHARED, else ../shared]
    #[arg(long, value_name = "DIR")]
    shared: Option<PathBuf>,
    /// Finished tasks are kept in this file; the same command continues a stopped run
    #[arg(long, value_name = "FILE", default_value = "optimizers.jsonl")]
    journal: PathBuf,
    /// Only these tasks
    #[arg(long, value_name = "AIM", value_parser = ["seeds", "wall", "hard", "spread"])]
    only: Option<String>,
    /// Run at most this many tasks
    #[arg(long, value_name = "N")]
    tasks: Option<usize>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    interrupt::watch();
    let name = args.optimizer.into_str();
    let mut tasks = optimizer_tasks(name, args.quick);
    tasks.retain(|task| args.only.as_ref().is_none_or(|only| task.aim == *only));
    tasks.truncate(args.tasks.unwrap_or(usize::MAX));
    let mut journal = OptimizerOutcome::journal(&args.journal)?;
    let beside = || std::env::var_os("LEADLAG_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let (shared, program) = (args.shared.clone().unwrap_or_else(beside), std::env::current_exe()?);
    let words = |task: &OptimizerTask| format!("variant {} on P{}-{}", task.model_id, task.platoon, task.follower);
    with_bar(&tasks, "tasks", &args.journal, words, |progress| {
        run_optimizers(&shared, &program, &tasks, &mut journal, progress)
    })?;
    let report = OptimizerReport::new(name, &tasks, &journal);
    if args.json { output::print_json(&report) } else { output::print(&report.table()) }
}
