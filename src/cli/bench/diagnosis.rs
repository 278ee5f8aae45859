//! `leadlag bench diagnosis`: how well a diagnosis names what is missing.

use super::super::lines::Lines;
use super::super::{interrupt, output};
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use leadlag::bench::{DiagnosisJournal, DiagnosisReport, SIZES, diagnosis_tasks, run_diagnoses};
use std::ops::ControlFlow;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Thirty cases of 5 minutes with little searching, instead of all of 15 minutes
    #[arg(long)]
    quick: bool,
    /// Only the first so many cases; they are shuffled
    #[arg(long, value_name = "N")]
    cases: Option<usize>,
    /// Decides everything that is planted
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Length of a drive in seconds [default: 900, with --quick 300]
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,
    /// Sizes at which each effect is planted, as the change of the follower's speed; more of them give power curves
    #[arg(long, value_name = "M/S,...", value_delimiter = ',', value_parser = size, default_values_t = SIZES)]
    sizes: Vec<f64>,
    /// Only cases of this kind
    #[arg(long, value_name = "KIND", value_parser = ["one", "pair", "none", "coloured", "absorbed", "outside", "family"])]
    only: Option<String>,
    /// Only this case, by the seed of its own that the journal has; may be given several times
    #[arg(long, value_name = "SEED")]
    case: Vec<u64>,
    /// How hard to search [default: normal, with --quick quick]
    #[arg(long, value_name = "EFFORT", value_parser = ["quick", "normal", "thorough"])]
    effort: Option<String>,
    /// Finished cases are kept in this file; the same command goes on where it was stopped
    #[arg(long, value_name = "FILE", default_value = "diagnosis.jsonl")]
    journal: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    interrupt::watch();
    let (duration, effort, count) = if args.quick { (300.0, "quick", 30) } else { (900.0, "normal", usize::MAX) };
    let effort = args.effort.as_deref().unwrap_or(effort);
    let mut tasks = diagnosis_tasks(args.seed, args.duration.unwrap_or(duration), effort, &args.sizes);
    tasks.retain(|task| args.only.as_ref().is_none_or(|only| task.kind == *only));
    tasks.retain(|task| args.case.is_empty() || args.case.contains(&task.seed));
    tasks.truncate(args.cases.unwrap_or(count));
    let mut journal = DiagnosisJournal::open(&args.journal)?;
    let bar = output::heard(ProgressBar::new(tasks.len() as u64))
        .with_style(ProgressStyle::with_template("{bar:20} {pos}/{len} cases, {eta} left  {msg}")?);
    let mut lines = Lines::new();
    run_diagnoses(&tasks, &mut journal, &mut |done, task| {
        bar.set_position(done as u64);
        bar.set_message(format!("{} {} {}", task.kind, task.base, task.causes.join(" + ")));
        lines.tell(|| format!("{done}/{} cases, {:#} left  {}", tasks.len(), HumanDuration(bar.eta()), bar.message()));
        if interrupt::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    bar.finish_and_clear();
    if interrupt::asked() {
        eprintln!("interrupted; the same command goes on from {}", args.journal.display());
    }
    let report = DiagnosisReport::new(&tasks, &journal);
    if args.json { output::print_json(&report) } else { output::print(&report.table()) }
}

fn size(text: &str) -> Result<f64, String> {
    let positive = text.parse().ok().filter(|size: &f64| size.is_finite() && *size > 0.0);
    positive.ok_or_else(|| "expected a root mean square change of speed above 0 m/s, like 0.1".to_owned())
}
