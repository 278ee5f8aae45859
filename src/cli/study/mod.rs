//! `leadlag study`: plan, run, submit, status, verify, merge, report.

pub mod merge;
mod plan;
mod report;
mod run;
pub mod status;
mod submit;
mod verify;

use clap::Subcommand;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Lay out a study in a folder; its tasks go to stdout, one per line, unless that is a terminal
    #[command(after_help = "Example:
  leadlag study plan examples/plans/small.toml --out study")]
    Plan(plan::Args),
    /// Compute the remaining tasks; may be interrupted, repeated and run in parallel
    #[command(after_help = "Examples:
  leadlag study run study
  leadlag study run study --shard 2/5")]
    Run(run::Args),
    /// Write job scripts for a cluster scheduler; submits nothing
    #[command(after_help = "Examples:
  leadlag study submit study --slurm
  leadlag study submit study --slurm --cpus 8 --sbatch --partition=short | sh")]
    Submit(submit::Args),
    /// Show finished, missing and damaged tasks
    #[command(after_help = "Example:
  leadlag study status study --json")]
    Status(status::Args),
    /// Recompute a share of the results and compare them
    #[command(after_help = "Example:
  leadlag study verify study --share 0.05")]
    Verify(verify::Args),
    /// Write the tables of a finished study
    #[command(after_help = "Example:
  leadlag study merge study")]
    Merge(merge::Args),
    /// Write tables and figures next to the paper's, with a comparison
    #[command(after_help = "Example:
  leadlag study report study")]
    Report(report::Args),
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.command {
        Command::Plan(args) => plan::run(args),
        Command::Run(args) => run::run(args),
        Command::Submit(args) => submit::run(args),
        Command::Status(args) => status::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Merge(args) => merge::run(args),
        Command::Report(args) => report::run(args),
    }
}
