//! `leadlag bench diagnosis`: rates of right and wrong names.

use super::super::{interrupt, output};
use super::with_bar;
use crate::api::values::whole;
use crate::bench::{
    DiagnosisOutcome, DiagnosisReport, DiagnosisTask, LARGEST_SEED, SIZES, diagnose_task, diagnosis_tasks,
    do_remaining, infer_task,
};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Thirty cases of 5 minutes with a short search, instead of all cases of 15 minutes
    #[arg(long)]
    quick: bool,
    /// Number of cases, in shuffled order
    #[arg(long, value_name = "N")]
    cases: Option<usize>,
    /// Seed of the planted effects
    #[arg(long, value_name = "SEED", default_value_t = 1, value_parser = whole(0, LARGEST_SEED), allow_negative_numbers = true)]
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
    /// Only this case, by its own seed in the journal; may be given several times
    #[arg(long, value_name = "SEED")]
    case: Vec<u64>,
    /// Search effort [default: normal, with --quick quick]
    #[arg(long, value_name = "EFFORT", value_parser = ["quick", "normal", "thorough"])]
    effort: Option<String>,
    /// Only the names, without the race; four times as fast
    #[arg(long)]
    names_only: bool,
    /// Journal of finished cases; repeat the command to resume
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
    let mut tasks = diagnosis_tasks(args.seed, args.duration.unwrap_or(duration), effort, &args.sizes)?;
    tasks.retain(|task| args.only.as_ref().is_none_or(|only| task.kind == *only));
    tasks.retain(|task| args.case.is_empty() || args.case.contains(&task.seed));
    let planned = tasks.len();
    tasks.truncate(args.cases.unwrap_or(count));
    let mut journal = DiagnosisOutcome::journal(&args.journal)?;
    let diagnose = if args.names_only { infer_task } else { diagnose_task };
    let words = |task: &DiagnosisTask| format!("{} {} {}", task.kind, task.base, task.causes.join(" + "));
    with_bar(&tasks, "cases", &args.journal, words, |progress| {
        do_remaining(&tasks, &mut journal, progress, |task, _| Ok(Some(diagnose(task))))
    })?;
    let report = DiagnosisReport::new(&tasks, planned, &journal);
    if args.json { output::print_json(&report) } else { output::print(&report.table()) }
}

fn size(text: &str) -> Result<f64, String> {
    let positive = text.parse().ok().filter(|size: &f64| size.is_finite() && *size > 0.0);
    positive.ok_or_else(|| "expected a root mean square change of speed above 0 m/s, like 0.1".to_owned())
}
