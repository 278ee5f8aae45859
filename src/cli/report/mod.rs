//! `leadlag report`: a calibration, a study or a diagnosis as one HTML file.

mod charts;
mod study;

use super::{Usage, output};
use anyhow::Context;
use leadlag::diagnose::outcome::Outcome;
use leadlag::report::html;
use leadlag::report::residuals::{error_budget, over_speed};
use leadlag::report::result::ResultFile;
use leadlag::report::sumo::Export;
use leadlag::trajectory::Source;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  leadlag report result/result.json -o report.html
  leadlag report diagnosis -o report.html
  leadlag report study -o report.html")]
pub struct Args {
    /// Folder (or its result.json or diagnosis.json) that calibrate or diagnose wrote with --out, or folder of a study
    #[arg(value_name = "RESULT|STUDY|DIAGNOSIS")]
    pub result: PathBuf,
    /// The HTML file: one file, no network needed
    #[arg(short, long, value_name = "FILE.html")]
    pub out: PathBuf,
}

/// What makes a folder one of the three kinds.
const FILES: [&str; 3] = ["diagnosis.json", "result.json", "tasks.jsonl"];

pub fn run(args: &Args) -> anyhow::Result<()> {
    let file = if args.result.is_dir() {
        let found = FILES.into_iter().map(|name| args.result.join(name)).find(|path| path.exists());
        let shown = args.result.display();
        let message = format!(
            "{shown}: expected a folder with result.json, diagnosis.json or tasks.jsonl (of a study), found none of them"
        );
        found.ok_or(Usage(message))?
    } else {
        args.result.clone()
    };
    let folder = file.parent().unwrap_or(Path::new("."));
    let page = if file.file_name().is_some_and(|name| name == "tasks.jsonl") {
        study::page(folder)?
    } else {
        one(&file, folder)?
    };
    output::write_file(&args.out, page.as_bytes())?;
    eprintln!("{} ({} kB)", args.out.display(), page.len() / 1000);
    Ok(())
}

/// The page of a calibration or of a diagnosis.
fn one(file: &Path, folder: &Path) -> anyhow::Result<String> {
    let text = std::fs::read_to_string(file).with_context(|| format!("{}: cannot read the result", file.display()))?;
    let is_diagnosis = serde_json::from_str::<serde_json::Value>(&text).is_ok_and(|json| json.get("verdict").is_some());
    if is_diagnosis {
        let outcome: Outcome = serde_json::from_str(&text)
            .with_context(|| format!("{}: expected a diagnosis of this version of leadlag", file.display()))?;
        return Ok(html::diagnosis(&outcome, charts::of_diagnosis(folder, &outcome)?));
    }
    let result = ResultFile::read(file)?;
    let (mut charts, simulated) = charts::of_calibration(folder, &result)?;
    charts.extend(over_speed(&simulated));
    let mut exported = Export::read(&folder.join("sumo/loss.json"))?;
    if exported.as_ref().is_some_and(|export| Source::of(file).is_ok_and(|now| now.sha256 != export.result_sha256)) {
        let (folder, file) = (folder.join("sumo"), file.display());
        eprintln!("warning: {} is of another result than {file}, so it is left out; export it again", folder.display());
        exported = None;
    }
    let exported =
        exported.map(|export| charts::of_sumo(folder, &export).map(|charts| (export, charts))).transpose()?;
    Ok(html::calibration(&result, charts, error_budget(&simulated).as_ref(), exported, &text))
}
