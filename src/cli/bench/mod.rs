//! `leadlag bench`: how fast candidates are simulated.

mod diagnosis;
mod optimizers;

use super::progress::Bar;
use super::{interrupt, output};
use crate::api::model::{known, model};
use crate::bench::{BenchError, Drive, Effort, Progress, run as measure, table};
use crate::trajectory::import;
use indicatif::HumanDuration;
use std::path::{Path, PathBuf};
use std::time::Duration;

#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    /// Three variants instead of all ninety; under a minute
    #[arg(long)]
    quick: bool,
    /// Only this variant, with 100, 1024 and 4096 candidates, on a hardware GPU also with 32768 and 262144
    #[arg(long, value_name = "MODEL", value_parser = known, conflicts_with = "quick")]
    model: Option<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Measured file to simulate on [default: a synthetic drive, the same everywhere]
    #[arg(long, value_name = "FILE")]
    data: Option<PathBuf>,
    /// The follower in that file: 1 is right behind the platoon leader
    #[arg(long, value_name = "N", default_value_t = 1, requires = "data")]
    follower: usize,
    /// Write the drive, the candidates and their f64 scores here instead of measuring, for other programs
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Measure the quality of an optimiser: targets for many seeds, spread of replicates
    #[command(after_help = "Example:
  leadlag bench optimizers --quick --shared ../shared")]
    Optimizers(optimizers::Args),
    /// Measure how well a diagnosis names planted effects, and its rate of false names
    #[command(after_help = "Examples:
  leadlag bench diagnosis --quick --cases 1 --journal one.jsonl
  leadlag bench diagnosis --seed 7 --effort quick --only none --journal n.jsonl")]
    Diagnosis(diagnosis::Args),
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.command {
        Some(Command::Optimizers(args)) => return optimizers::run(args),
        Some(Command::Diagnosis(args)) => return diagnosis::run(args),
        None => {}
    }
    let drive = match &args.data {
        Some(path) => {
            let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
            Drive::new(&name, &import::read(path, None)?, args.follower)?
        }
        None => Drive::synthetic()?,
    };
    if let Some(folder) = &args.export {
        output::make_folder(folder)?;
        return Ok(crate::bench::export(&drive, folder)?);
    }
    let whole = if args.quick { Effort::Quick } else { Effort::Full };
    let asked = args.model.as_deref().map(model).transpose()?;
    let effort = asked.map_or(whole, Effort::Variant);
    let mut bar = Bar::new("{spinner} {msg}, {elapsed}", None, Duration::ZERO);
    let report = measure(&drive, effort, &mut |what| {
        bar.show(0, what.to_owned(), |bar| format!("{what}, {:#}", HumanDuration(bar.elapsed())));
    });
    bar.finish();
    let report = report?;
    if args.json { output::print_json(&report.json()) } else { output::print(&table(&report)) }
}

/// Runs tasks with a bar, or lines instead; after Ctrl-C it prints how to continue. `task` is the present one in words.
fn with_bar<T: Sync>(
    tasks: &[T],
    plural: &str,
    journal: &Path,
    task: impl Fn(&T) -> String + Sync,
    run: impl FnOnce(&mut Progress<'_, T>) -> Result<(), BenchError>,
) -> anyhow::Result<()> {
    let (template, all) = (format!("{{bar:20}} {{pos}}/{{len}} {plural}, {{eta}} left  {{msg}}"), tasks.len());
    let mut bar = Bar::new(&template, Some(all as u64), Duration::ZERO);
    run(&mut |done, next| {
        bar.show(done as u64, task(next), |bar| {
            format!("{done}/{all} {plural}, {:#} left  {}", HumanDuration(bar.eta()), bar.message())
        });
        interrupt::go_on()
    })?;
    bar.finish();
    if interrupt::asked() {
        eprintln!("interrupted; the same command continues from {}", journal.display());
    }
    Ok(())
}
