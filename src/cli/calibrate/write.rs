//! The files of a calibration.

use super::super::data::Loaded;
use super::super::folder::{of_calibration, tidy};
use super::super::output::write_file;
use leadlag::evaluator::Evaluator;
use leadlag::reference::{Reference, Trace};
use leadlag::report::result::ResultFile;
use leadlag::report::{plot, simulation};
use leadlag::rescore;
use std::path::Path;
use std::time::Duration;

/// result.json, timing.json, and per trajectory simulation.csv and plot.svg (numbered if there are several). What another number of
/// trajectories left there is removed.
pub fn files(
    folder: &Path,
    result: &ResultFile,
    reference: &Reference,
    loaded: &[Loaded],
    elapsed: Duration,
) -> anyhow::Result<()> {
    let before = of_calibration(folder);
    write_file(&folder.join("result.json"), result.to_json().as_bytes())?;
    let steps: usize = result.data.iter().map(|d| d.samples).sum();
    let seconds = elapsed.as_secs_f64();
    let timing = serde_json::json!({
        "schema_version": result.schema_version,
        "wall_s": seconds,
        "threads": rayon::current_num_threads(),
        "evaluations_per_s": result.evaluations as f64 / seconds,
        "candidate_steps_per_s": result.evaluations as f64 * steps as f64 / seconds,
    });
    write_file(&folder.join("timing.json"), (serde_json::to_string_pretty(&timing)? + "\n").as_bytes())?;

    let mut written = Vec::new();
    let parameters = result.calibrated_variant()?.parameters;
    for (i, (case, one)) in reference.cases().iter().zip(loaded).enumerate() {
        let suffix = if loaded.len() == 1 { String::new() } else { format!("_{}", i + 1) };
        let mut trace = Trace::default();
        let outcome = rescore::outcome(case, &parameters, &mut trace)?;
        let t = &one.trajectory.t;
        let mut csv = Vec::new();
        simulation::write_csv(&mut csv, t, case, &trace)?;
        let [table, picture] = [format!("simulation{suffix}.csv"), format!("plot{suffix}.svg")];
        write_file(&folder.join(&table), &csv)?;
        let title = format!("{}, {}: variant {} {}", case.label, one.trajectory.name, result.model_id, result.model());
        let svg = plot::draw(&title, plot::AHEAD, t, case, &trace, &outcome)?;
        write_file(&folder.join(&picture), svg.as_bytes())?;
        written.extend([table, picture]);
    }
    tidy(folder, before, &written)
}
