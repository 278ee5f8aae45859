//! `leadlag report`: a calibration or a diagnosis as one HTML file.

use super::{Usage, output};
use anyhow::Context;
use leadlag::diagnose::outcome::Outcome;
use leadlag::report::html::{self, Chart, Line, Panel, Role};
use leadlag::report::result::ResultFile;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  leadlag report result/result.json -o report.html
  leadlag report diagnosis -o report.html")]
pub struct Args {
    /// Folder (or its result.json or diagnosis.json) that calibrate or diagnose wrote with --out
    #[arg(value_name = "RESULT|DIAGNOSIS")]
    pub result: PathBuf,
    /// The HTML file: one file, no network needed
    #[arg(short, long, value_name = "FILE.html")]
    pub out: PathBuf,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let file = if args.result.is_dir() {
        let names = ["diagnosis.json", "result.json"].map(|name| args.result.join(name));
        let found = names.into_iter().find(|path| path.exists());
        let message =
            format!("{}: expected result.json or diagnosis.json in the folder, found neither", args.result.display());
        found.ok_or(Usage(message))?
    } else {
        args.result.clone()
    };
    let text = std::fs::read_to_string(&file).with_context(|| format!("{}: cannot read the result", file.display()))?;
    let folder = file.parent().unwrap_or(Path::new("."));
    let is_diagnosis = serde_json::from_str::<serde_json::Value>(&text).is_ok_and(|json| json.get("verdict").is_some());
    let page = if is_diagnosis {
        let outcome: Outcome = serde_json::from_str(&text)
            .with_context(|| format!("{}: expected a diagnosis of this version of leadlag", file.display()))?;
        html::diagnosis(&outcome, diagnosis_charts(folder, &outcome)?)
    } else {
        let result = ResultFile::read(&file)?;
        let charts = calibration_charts(folder, result.data.len())?;
        html::calibration(&result, charts, &text)
    };
    output::write_file(&args.out, page.as_bytes())?;
    eprintln!("{} ({} kB)", args.out.display(), page.len() / 1000);
    Ok(())
}

/// The columns of a table by name; empty fields are NaN.
fn columns(path: &Path) -> anyhow::Result<BTreeMap<String, Vec<f64>>> {
    let place = || format!("{}: cannot read the series", path.display());
    let mut reader = csv::Reader::from_path(path).with_context(place)?;
    let names: Vec<String> = reader.headers().with_context(place)?.iter().map(str::to_owned).collect();
    let mut columns: BTreeMap<String, Vec<f64>> = names.iter().map(|name| (name.clone(), Vec::new())).collect();
    for row in reader.records() {
        for (name, field) in names.iter().zip(row.with_context(place)?.iter()) {
            columns.entry(name.clone()).or_default().push(field.parse().unwrap_or(f64::NAN));
        }
    }
    Ok(columns)
}

/// The panels s, v, a of columns with these prefixes.
fn panels(table: &BTreeMap<String, Vec<f64>>, lines: &[(&str, &str, Role)]) -> Vec<Panel> {
    let signals =
        [("spacing s [m]", "spacing_m"), ("speed v [m/s]", "speed_mps"), ("acceleration a [m/s²]", "accel_mps2")];
    let panel = |(label, column): &(&str, &str)| {
        let ahead = table.get("lead_speed_mps").filter(|_| *column == "speed_mps");
        let mut own: Vec<Line> = ahead.map(|v| Line::new("car ahead", Role::Context, v)).into_iter().collect();
        for (prefix, name, role) in lines {
            own.extend(table.get(&format!("{prefix}{column}")).map(|values| Line::new(name, *role, values)));
        }
        Panel { label: (*label).to_owned(), lines: own }
    };
    signals.iter().map(panel).collect()
}

fn diagnosis_charts(folder: &Path, outcome: &Outcome) -> anyhow::Result<Vec<Chart>> {
    let mut charts = Vec::new();
    for number in 1.. {
        let path = folder.join(format!("simulation_{number}.csv"));
        if !path.exists() {
            break;
        }
        let table = columns(&path)?;
        let lines = [
            ("", "measured", Role::Observed),
            ("base_", "base", Role::Simulated),
            ("extended_", "extended", Role::Alternative),
        ];
        let mut panels = panels(&table, &lines);
        let missing = folder.join(format!("missing_acceleration_{number}.csv"));
        if missing.exists() {
            let table = columns(&missing)?;
            let of = |column: &str, name, role| table.get(column).map(|d| Line::new(name, role, d));
            let base = of("missing_accel_mps2", "base", Role::Simulated);
            let extended = of("extended_missing_accel_mps2", "extended", Role::Alternative);
            let lines =
                base.into_iter().chain(extended).filter(|line| line.values.iter().any(Option::is_some)).collect();
            panels.push(Panel { label: "missing a [m/s²]".to_owned(), lines });
        }
        let x = table.get("time_s").cloned().unwrap_or_default();
        let title = outcome.drives.get(number - 1).map_or(format!("Drive {number}"), |drive| {
            let role = if drive.role == "holdout" { "held back" } else { "trained on" };
            format!("{} ({role})", drive.label)
        });
        charts.push(Chart { title, x_label: "time [s]".to_owned(), x, panels });
    }
    Ok(charts)
}

fn calibration_charts(folder: &Path, count: usize) -> anyhow::Result<Vec<Chart>> {
    let mut charts = Vec::new();
    for number in 1..=count {
        let suffix = if count == 1 { String::new() } else { format!("_{number}") };
        let path = folder.join(format!("simulation{suffix}.csv"));
        if !path.exists() {
            eprintln!("warning: {} is not there, so its charts are missing", path.display());
            continue;
        }
        let table = columns(&path)?;
        let lines = [("", "observed", Role::Observed), ("sim_", "simulated", Role::Simulated)];
        let mut panels = panels(&table, &lines);
        if let (Some(v), Some(sim)) = (table.get("speed_mps"), table.get("sim_speed_mps")) {
            let residual: Vec<f64> = sim.iter().zip(v).map(|(sim, v)| sim - v).collect();
            let line = Line::new("simulated - observed", Role::Simulated, &residual);
            panels.push(Panel { label: "residual of v [m/s]".to_owned(), lines: vec![line] });
        }
        let x = table.get("time_s").cloned().unwrap_or_default();
        charts.push(Chart { title: format!("Trajectory {number}"), x_label: "time [s]".to_owned(), x, panels });
    }
    Ok(charts)
}
