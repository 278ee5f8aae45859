//! The time charts of a report, from the tables that calibrate and diagnose leave behind.

use super::super::folder::suffix;
use crate::report::html::Chart;
use crate::report::panel::{Panel, Series, Style};
use crate::report::residuals::{Simulated, other_errors};
use crate::result::diagnosis::Outcome;
use crate::result::{DataEntry, ResultFile};
use crate::sumo::Export;
use crate::text::bounded::Lines;
use anyhow::Context;
use std::collections::BTreeMap;
use std::path::Path;

/// Names of the panels, and of the columns that they show.
const SIGNALS: [(&str, &str); 3] =
    [("spacing s [m]", "spacing_m"), ("speed v [m/s]", "speed_mps"), ("acceleration a [m/s²]", "accel_mps2")];

/// Warning about a simulation that does not belong to its result.
const LEFT_OUT: &str =
    "its charts are left out; `leadlag calibrate` with this folder as --out writes all its files again";

/// The columns of a table by name; empty fields are NaN.
pub(super) fn columns(path: &Path) -> anyhow::Result<BTreeMap<String, Vec<f64>>> {
    let place = || format!("{}: cannot read the series", path.display());
    let mut reader = csv::Reader::from_reader(Lines::of_table(path).with_context(place)?);
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
fn panels(table: &BTreeMap<String, Vec<f64>>, lines: &[(&str, &str, Style)]) -> Vec<Panel> {
    let panel = |(label, column): &(&str, &str)| {
        let ahead = table.get("lead_speed_mps").filter(|_| *column == "speed_mps");
        let mut own: Vec<Series> =
            ahead.map(|v| Series::new("car ahead", Style::Context, v.clone())).into_iter().collect();
        for (prefix, name, role) in lines {
            own.extend(table.get(&format!("{prefix}{column}")).map(|values| Series::new(name, *role, values.clone())));
        }
        Panel::new(label, own)
    };
    SIGNALS.iter().map(panel).collect()
}

/// Charts of the drives.
pub fn of_diagnosis(folder: &Path, outcome: &Outcome) -> anyhow::Result<Vec<Chart>> {
    let mut charts = Vec::new();
    for (number, drive) in (1..).zip(&outcome.drives) {
        let path = folder.join(format!("simulation_{number}.csv"));
        if !path.exists() {
            break;
        }
        let table = columns(&path)?;
        let lines = [
            ("", "measured", Style::Observed),
            ("base_", "base", Style::Simulated),
            ("extended_", "extended", Style::Alternative),
        ];
        let mut panels = panels(&table, &lines);
        let missing = folder.join(format!("missing_acceleration_{number}.csv"));
        if missing.exists() {
            let table = columns(&missing)?;
            let of = |column: &str, name, role| table.get(column).map(|d| Series::new(name, role, d.clone()));
            let base = of("missing_accel_mps2", "base", Style::Simulated);
            let extended = of("extended_missing_accel_mps2", "extended", Style::Alternative);
            let lines = base
                .into_iter()
                .chain(extended)
                .filter(|line| line.values.iter().any(|value| value.is_finite()))
                .collect();
            panels.push(Panel::new("missing a [m/s²]", lines));
        }
        let x = table.get("time_s").cloned().unwrap_or_default();
        let role = if drive.role == "holdout" { "held back" } else { "trained on" };
        let title = format!("{} ({role})", drive.label);
        charts.push(Chart { title, x_label: "time [s]".to_owned(), x, points: false, panels });
    }
    Ok(charts)
}

/// SUMO beside leadlag on each drive.
pub fn of_sumo(folder: &Path, export: &Export) -> anyhow::Result<Vec<Chart>> {
    let mut charts = Vec::new();
    // Without losses, SUMO was not run, and its files there belong to an earlier export.
    for (number, (drive, _)) in export.data.iter().zip(&export.loss).enumerate() {
        let path = folder.join(format!("sumo/comparison{}.csv", suffix(number, export.data.len())));
        if path.exists() {
            let table = columns(&path)?;
            let panels =
                panels(&table, &[("sim_", "leadlag", Style::Simulated), ("sumo_", "SUMO", Style::Alternative)]);
            let x = table.get("time_s").cloned().unwrap_or_default();
            let title = format!("leadlag and SUMO behind the leader of {}", drive.path);
            charts.push(Chart { title, x_label: "time [s]".to_owned(), x, points: false, panels });
        }
    }
    Ok(charts)
}

/// File and follower of a trajectory; the folders of the file only if another one has the same name.
fn label(entry: &DataEntry, all: &[DataEntry]) -> String {
    let name = |entry: &DataEntry| Path::new(&entry.path).file_name().map(ToOwned::to_owned);
    let alike = all.iter().any(|other| other.path != entry.path && name(other) == name(entry));
    let file = name(entry).filter(|_| !alike).map(|name| name.to_string_lossy().into_owned());
    let file = file.unwrap_or_else(|| entry.path.clone());
    let is_same = |other: &&DataEntry| other.path == entry.path && other.follower == entry.follower;
    // The drives of a table have the same number.
    let car = if all.iter().filter(is_same).count() > 1 { format!(" {}", entry.name) } else { String::new() };
    format!("{file}, follower {}{car}", entry.follower)
}

/// Charts and residuals of each trajectory.
pub fn of_calibration(folder: &Path, result: &ResultFile) -> anyhow::Result<(Vec<Chart>, Vec<Simulated>)> {
    let count = result.data.len();
    let (mut charts, mut all) = (Vec::new(), Vec::new());
    for (number, entry) in result.data.iter().enumerate() {
        let path = folder.join(format!("simulation{}.csv", suffix(number, count)));
        if !path.exists() {
            eprintln!("warning: {} is missing, and so are its charts", path.display());
            continue;
        }
        let table = columns(&path)?;
        let lines = [("", "observed", Style::Observed), ("sim_", "simulated", Style::Simulated)];
        let mut panels = panels(&table, &lines);
        let column = |name: &str| table.get(name).cloned().unwrap_or_default();
        let signals = |prefix: &str| SIGNALS.map(|(_, name)| column(&format!("{prefix}{name}")));
        let one = Simulated {
            label: label(entry, &result.data),
            t: column("time_s"),
            v_l: column("lead_speed_mps"),
            measured: signals(""),
            simulated: signals("sim_"),
            first: entry.first_scored,
        };
        if let Some(why) = one.other_drive(entry) {
            eprintln!("warning: {} belongs to another drive: {why}; {LEFT_OUT}", path.display());
            continue;
        }
        for (k, label) in ["residual of s [m]", "residual of v [m/s]", "residual of a [m/s²]"].into_iter().enumerate()
        {
            let pairs = one.simulated[k].iter().zip(&one.measured[k]);
            let residual: Vec<f64> = pairs.map(|(simulated, measured)| simulated - measured).collect();
            let line = Series::new("simulated - observed", Style::Simulated, residual);
            panels.push(Panel::new(label, vec![line]));
        }
        let title = format!("{}, follower {} {}", entry.path, entry.follower, entry.name);
        charts.push(Chart { title, x_label: "time [s]".to_owned(), x: one.t.clone(), points: false, panels });
        all.push(one);
    }
    if let Some(why) = other_errors(&all, result).filter(|_| all.len() == count) {
        let files = if count == 1 { "simulation.csv is" } else { "simulation_1.csv, ... are" };
        eprintln!("warning: {}: {files} of another result: {why}; {LEFT_OUT}", folder.display());
        return Ok((Vec::new(), Vec::new()));
    }
    Ok((charts, all))
}
