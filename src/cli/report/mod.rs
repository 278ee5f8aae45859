//! `leadlag report`: a calibration, a fleet, a study or a diagnosis as one HTML file.

mod charts;
pub mod fleet;
mod study;

use super::change::settle;
use super::demo::quoted;
use super::folder::{DIAGNOSIS, FLEET, RESULT, RUN, parsed};
use super::output;
use crate::api::error::refuse;
use crate::report::html::{self, DriveErrors, MadeBy};
use crate::report::residuals::{error_budget, over_speed};
use crate::result::diagnosis::Outcome;
use crate::result::{ResultFile, read_bounded};
use crate::sumo::Export;
use crate::text::shown::{NAMED, first};
use crate::trajectory::Source;
use anyhow::{Context, bail};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  leadlag report result/result.json -o report.html
  leadlag report diagnosis -o report.html
  leadlag report study -o report.html
  leadlag report fleet -o report.html")]
pub struct Args {
    /// Output folder of calibrate, diagnose or study, or its result.json, diagnosis.json or fleet.json
    #[arg(value_name = "RESULT|FLEET|DIAGNOSIS|STUDY")]
    pub result: PathBuf,
    /// The HTML file: one file, no network needed
    #[arg(short, long, value_name = "FILE.html")]
    pub out: PathBuf,
}

/// Distinguishes a diagnosis from a calibration.
#[derive(serde::Deserialize)]
struct Kind {
    verdict: Option<serde::de::IgnoredAny>,
}

/// The mark of each of the four kinds of folders.
const FILES: [&str; 4] = [DIAGNOSIS, RESULT, FLEET, "tasks.jsonl"];

pub fn run(args: &Args) -> anyhow::Result<()> {
    let ending = args.out.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    if let Some(ending) = ending.filter(|ending| !["html", "htm"].contains(&ending.as_str())) {
        // A version after a dot belongs to the name.
        let known = ["pdf", "png", "svg", "json", "csv", "md", "txt"].contains(&ending.as_str());
        let html =
            if known { args.out.with_extension("html") } else { args.out.with_extension(format!("{ending}.html")) };
        let shown = args.out.display();
        refuse!(
            "--out {shown}: a report is an HTML file; expected an ending .html or .htm, found .{ending}; give {}{}",
            html.display(),
            if ending == "pdf" { ", which a browser prints to PDF" } else { "" }
        );
    }
    settle(if args.result.is_dir() { &args.result } else { args.result.parent().unwrap_or(Path::new(".")) })?;
    let page = page(&if args.result.is_dir() { result_in(args)? } else { args.result.clone() })?;
    output::write_file(&args.out, page.as_bytes())?;
    eprintln!("{} ({} kB)", args.out.display(), page.len() / 1000);
    Ok(())
}

/// The page for the main file of a result.
pub fn page(file: &Path) -> anyhow::Result<String> {
    let folder = file.parent().unwrap_or(Path::new("."));
    let made = made_by(folder)?;
    match file.file_name().and_then(|name| name.to_str()) {
        Some("tasks.jsonl") => study::page(folder),
        Some(FLEET) => fleet::page(folder, made.as_ref()),
        _ => one(file, folder, made.as_ref()),
    }
}

/// The command that made the files of a folder, if known.
fn made_by(folder: &Path) -> anyhow::Result<Option<MadeBy>> {
    let path = folder.join(RUN);
    if !path.exists() {
        return Ok(None);
    }
    let text = read_bounded(&path)?;
    let made = serde_json::from_str(&text).with_context(|| {
        format!("{}: expected the command of a result, as leadlag writes it; remove the file", path.display())
    })?;
    Ok(Some(made))
}

/// The file that marks the kind of a folder.
fn result_in(args: &Args) -> anyhow::Result<PathBuf> {
    let of = |folder: &Path| FILES.into_iter().map(|name| folder.join(name)).find(|path| path.exists());
    if let Some(found) = of(&args.result) {
        return Ok(found);
    }
    let shown = args.result.display();
    let entries = std::fs::read_dir(&args.result).with_context(|| format!("{shown}: cannot list the folder"))?;
    let mut inside: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|path| of(path).is_some()).collect();
    inside.sort();
    let instead = if inside.is_empty() {
        String::new()
    } else {
        let named: Vec<String> = inside.iter().map(|path| path.display().to_string()).collect();
        let hold = if inside.len() == 1 { "holds one" } else { "hold one each" };
        let out = args.out.display().to_string();
        format!("; {} {hold}: `leadlag report {} -o {}`", first(&named, NAMED), quoted(&named[0]), quoted(&out))
    };
    refuse!(
        "{shown}: expected a folder with result.json, diagnosis.json, fleet.json or tasks.jsonl (of a study), found none of them{instead}"
    );
}

/// The page of a calibration or of a diagnosis.
fn one(file: &Path, folder: &Path, made: Option<&MadeBy>) -> anyhow::Result<String> {
    let text = read_bounded(file)?;
    let Ok(Kind { verdict }) = serde_json::from_str(&text) else {
        bail!(
            "{}: expected a folder that calibrate, diagnose or study wrote, or its result.json or diagnosis.json; this file is not JSON",
            file.display()
        );
    };
    if verdict.is_some() {
        let outcome: Outcome = parsed(&text, file, "a diagnosis")?;
        return Ok(html::diagnosis(&outcome, charts::of_diagnosis(folder, &outcome)?, made));
    }
    let result = ResultFile::read(file)?;
    let (mut charts, simulated) = charts::of_calibration(folder, &result)?;
    charts.extend(over_speed(&simulated));
    settle(&folder.join("sumo"))?;
    let mut exported = Export::read(&folder.join("sumo/loss.json"))?;
    if exported.as_ref().is_some_and(|export| Source::of(file).is_ok_and(|now| now.sha256 != export.result_sha256)) {
        let (folder, file) = (folder.join("sumo"), file.display());
        eprintln!(
            "warning: {} belongs to another result than {file}, so it is left out; export it again",
            folder.display()
        );
        exported = None;
    }
    let exported =
        exported.map(|export| charts::of_sumo(folder, &export).map(|charts| (export, charts))).transpose()?;
    let errors = error_budget(&simulated)
        .map(|all| DriveErrors { all, each: simulated.iter().map(|one| (one.label.clone(), one.rms())).collect() });
    Ok(html::calibration(&result, charts, errors.as_ref(), exported, &text, made))
}
