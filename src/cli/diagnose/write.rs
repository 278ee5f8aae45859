//! The files of a diagnosis.

use super::super::change::Change;
use super::super::folder::{DIAGNOSIS, RACE, RECOMMENDED_BOUNDS, finish, of_diagnosis};
use crate::describe::{Diagnosis, Series};
use crate::diagnose::Drive;
use crate::diagnose::describe::free::Free;
use crate::report::diagnosis::pictures;
use crate::report::panel::{self, Panel, Style};
use crate::report::svg::render;
use crate::result::diagnosis::Outcome;
use std::path::Path;

/// diagnosis.json, per drive missing_acceleration_N.csv and simulation_N.svg, the pictures, each adopted cause as NAME.wgsl, and the bounds of the recommended model.
pub fn files(folder: &Path, diagnosis: &Diagnosis, train: &[Drive], holdout: &[Drive]) -> anyhow::Result<()> {
    let outcome = &diagnosis.outcome;
    let mut change = Change::begin(folder)?;
    let before = of_diagnosis(folder);
    let is_named = |name: &str| outcome.causes.iter().any(|cause| cause.name == name);
    for adopted in diagnosis.inference.adopted.iter().filter(|adopted| is_named(&adopted.extension.name)) {
        change.write(&format!("{}.wgsl", adopted.extension.name), adopted.extension.text.as_bytes())?;
    }
    let extended = diagnosis.extended.as_ref();
    for (i, drive) in train.iter().chain(holdout).enumerate() {
        let left = extended.and_then(|e| e.series.get(i));
        let table = table(&diagnosis.base.series[i], left)?;
        change.write(&format!("missing_acceleration_{}.csv", i + 1), &table)?;
        let runs = [Some(&diagnosis.base.runs[i]), extended.and_then(|e| e.runs.get(i))];
        let role = if i < train.len() { "training" } else { "held back" };
        change.write(&format!("simulation_{}.svg", i + 1), simulation(drive, role, runs)?.as_bytes())?;
        change.write(&format!("simulation_{}.csv", i + 1), &states(drive, runs)?)?;
    }
    if let Some(missing) = &outcome.missing {
        let title = "What the missing acceleration depends on";
        let picture = pictures::missing(title, missing, outcome.missing_left.as_ref());
        change.write("missing_acceleration.svg", picture.as_bytes())?;
    }
    result(change, folder, before, outcome)
}

/// The files of a fleet: those of one car without the drives.
pub fn of_fleet(folder: &Path, outcome: &Outcome) -> anyhow::Result<()> {
    result(Change::begin(folder)?, folder, of_diagnosis(folder), outcome)
}

/// diagnosis.json, the picture of the race, and the bounds of the recommended model.
fn result(mut change: Change, folder: &Path, before: Vec<String>, outcome: &Outcome) -> anyhow::Result<()> {
    if !outcome.closed_loop.trials.is_empty() {
        change.write(RACE, pictures::race("Models on unseen data", &outcome.closed_loop).as_bytes())?;
    }
    if let Some(recommended) = &outcome.recommended {
        let bounds: String = recommended
            .bounds
            .iter()
            .map(|(name, [lower, upper])| format!("{name} = [{lower:?}, {upper:?}]\n"))
            .collect();
        change.write(RECOMMENDED_BOUNDS, bounds.as_bytes())?;
    }
    change.write(DIAGNOSIS, outcome.to_json().as_bytes())?;
    finish(change, folder, before)
}

/// d(t) of base and extended model with the signals around it.
fn table(base: &Series, extended: Option<&Series>) -> csv::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "time_s",
        "missing_accel_mps2",
        "missing_accel_sd_mps2",
        "extended_missing_accel_mps2",
        "speed_mps",
        "spacing_m",
        "speed_difference_mps",
        "lead_accel_mps2",
        "gap_error_m",
        "sin_grade",
        "place_m",
    ])?;
    let scene = &base.scene;
    for i in 0..scene.len() {
        let text = |value: f64| if value.is_finite() { value.to_string() } else { String::new() };
        let optional = |values: Option<&Vec<f64>>| values.map_or(String::new(), |v| text(v[i]));
        writer.write_record([
            text(scene.t[i]),
            text(base.d[i]),
            text(base.error),
            optional(extended.map(|e| &e.d)),
            text(scene.v[i]),
            text(scene.s[i]),
            text(scene.dv[i]),
            text(scene.a_l[i]),
            optional(base.gap_error.as_ref()),
            optional(scene.sin_grade.as_ref()),
            optional(scene.place.as_ref()),
        ])?;
    }
    writer.into_inner().map_err(|e| csv::Error::from(e.into_error()))
}

/// Measured states beside those of both models' free simulations; a run that ended early leaves empty fields.
fn states(drive: &Drive, runs: [Option<&Free>; 2]) -> csv::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let signals = ["spacing_m", "speed_mps", "accel_mps2"];
    let mut header = vec!["time_s".to_owned(), "lead_speed_mps".to_owned()];
    header.extend(signals.map(str::to_owned));
    for (name, run) in ["base", "extended"].iter().zip(&runs) {
        header.extend(signals.iter().filter(|_| run.is_some()).map(|signal| format!("{name}_{signal}")));
    }
    writer.write_record(&header)?;
    let trajectory = &drive.trajectory;
    let text = |value: f64| if value.is_finite() { value.to_string() } else { String::new() };
    for i in 0..trajectory.len() {
        let a = if i > 0 { (trajectory.v_f[i] - trajectory.v_f[i - 1]) / trajectory.dt } else { f64::NAN };
        let mut row = [trajectory.t[i], trajectory.v_l[i], trajectory.s[i], trajectory.v_f[i], a].map(text).to_vec();
        for run in runs.iter().flatten() {
            let at = |k: usize| i.checked_sub(run.first).and_then(|i| run.simulated[k].get(i)).copied();
            row.extend((0..3).map(|k| at(k).map_or(String::new(), text)));
        }
        writer.write_record(&row)?;
    }
    writer.into_inner().map_err(|e| csv::Error::from(e.into_error()))
}

/// Measured, base and extended over time.
fn simulation(drive: &Drive, role: &str, runs: [Option<&Free>; 2]) -> anyhow::Result<String> {
    let trajectory = &drive.trajectory;
    let count = trajectory.len();
    let line = |name: &str, style, mut values: Vec<f64>| {
        values.resize(count, f64::NAN);
        panel::Series::new(name, style, values)
    };
    let acceleration: Vec<f64> =
        std::iter::once(f64::NAN).chain(trajectory.v_f.windows(2).map(|w| (w[1] - w[0]) / trajectory.dt)).collect();
    let measured = [&trajectory.s, &trajectory.v_f, &acceleration];
    let labels = ["spacing s [m]", "speed v [m/s]", "acceleration a [m/s²]"];
    let panel = |k: usize| {
        let mut series = vec![line("measured", Style::Observed, measured[k].clone())];
        for (run, (name, style)) in runs.iter().zip([("base", Style::Simulated), ("extended", Style::Alternative)]) {
            let Some(run) = run else { continue };
            let mut values = vec![f64::NAN; run.first];
            values.extend(&run.simulated[k]);
            series.push(line(name, style, values));
        }
        Panel::new(labels[k], series)
    };
    let title = format!("{} ({role})\nfree simulation with the parameters of the diagnosis", drive.label());
    Ok(render(&title, &trajectory.t, &[panel(0), panel(1), panel(2)])?)
}
