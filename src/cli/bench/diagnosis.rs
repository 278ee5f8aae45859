//! `leadlag bench diagnosis`: rates of right and wrong names.

use super::super::{interrupt, output};
use super::with_bar;
use crate::api::values::whole;
use crate::bench::Machine;
use crate::bench::{
    DiagnosisReport, DiagnosisTask, Journal, LARGEST_SEED, SIZES, diagnose_task, diagnosis_tasks, infer_task,
    run_diagnoses,
};
use crate::diagnose::PROGRAM;
use crate::report::naming::{self, Provenance};
use crate::text::bounded::{self, TEXT_MAX};
use anyhow::Context;
use std::path::{Path, PathBuf};

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
    /// Write tables and pictures into this Markdown page, between two lines that mark the place, and the pictures into `images` beside it
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    interrupt::watch();
    // Check the page first, because the results take an hour.
    let page = args.page.as_deref().map(|page| into_page(page, "").map(|_| page)).transpose()?;
    let (duration, effort, count) = if args.quick { (300.0, "quick", 30) } else { (900.0, "normal", usize::MAX) };
    let effort = args.effort.as_deref().unwrap_or(effort);
    let mut tasks = diagnosis_tasks(args.seed, args.duration.unwrap_or(duration), effort, &args.sizes)?;
    tasks.retain(|task| args.only.as_ref().is_none_or(|only| task.kind == *only));
    tasks.retain(|task| args.case.is_empty() || args.case.contains(&task.seed));
    let planned = tasks.len();
    tasks.truncate(args.cases.unwrap_or(count));
    let mut journal = Journal::open(&args.journal)?;
    let diagnose = if args.names_only { infer_task } else { diagnose_task };
    let words = |task: &DiagnosisTask| format!("{} {} {}", task.kind, task.base, task.causes.join(" + "));
    with_bar(&tasks, "cases", &args.journal, words, |progress| {
        run_diagnoses(&tasks, &mut journal, diagnose, progress)
    })?;
    let report = DiagnosisReport::new(&tasks, planned, &journal);
    if let Some(page) = page {
        write(page, &report, command(args))?;
    }
    if args.json { output::print_json(&report) } else { output::print(&report.table()) }
}

/// The page with its results replaced.
fn into_page(page: &Path, part: &str) -> anyhow::Result<String> {
    let name = page.display();
    let text = bounded::read_to_string(page, TEXT_MAX).with_context(|| format!("{name}: cannot read the page"))?;
    naming::into_page(&text, part).with_context(|| format!("{name}: no place for the results"))
}

/// Writes the pictures, and then the page that shows them.
fn write(page: &Path, report: &DiagnosisReport, command: String) -> anyhow::Result<()> {
    const PICTURES: [&str; 2] = ["images/diagnosis_names.svg", "images/diagnosis_power.svg"];
    let folder = page.parent().unwrap_or(Path::new(""));
    output::make_folder(&folder.join("images"))?;
    for (name, picture) in PICTURES.iter().zip([naming::names(report), naming::power(report)]) {
        output::write_file(&folder.join(name), picture.as_bytes())?;
    }
    let from = Provenance {
        command,
        program: PROGRAM.clone(),
        machine: Machine::here().to_string(),
        date: chrono::Utc::now().date_naive().to_string(),
    };
    output::write_file(page, into_page(page, &naming::part(report, &from, PICTURES))?.as_bytes())
}

/// Settings that give the same cases.
fn command(args: &Args) -> String {
    let mut words = vec!["leadlag bench diagnosis".to_owned(), format!("--seed {}", args.seed)];
    words.extend(args.quick.then(|| "--quick".to_owned()));
    words.extend(args.effort.as_ref().map(|effort| format!("--effort {effort}")));
    words.extend(args.duration.map(|duration| format!("--duration {duration}")));
    if args.sizes != SIZES {
        let sizes: Vec<String> = args.sizes.iter().map(f64::to_string).collect();
        words.push(format!("--sizes {}", sizes.join(",")));
    }
    words.extend(args.names_only.then(|| "--names-only".to_owned()));
    words.extend(args.only.as_ref().map(|kind| format!("--only {kind}")));
    words.extend(args.case.iter().map(|case| format!("--case {case}")));
    words.extend(args.cases.map(|cases| format!("--cases {cases}")));
    words.join(" ")
}

fn size(text: &str) -> Result<f64, String> {
    let positive = text.parse().ok().filter(|size: &f64| size.is_finite() && *size > 0.0);
    positive.ok_or_else(|| "expected a root mean square change of speed above 0 m/s, like 0.1".to_owned())
}
