//! The files of a calibration.

use super::super::change::Change;
use super::super::folder::{RESULT, finish, of_calibration, suffix};
use crate::api::loading::Loaded;
use crate::evaluator::Case;
use crate::reference::Trace;
use crate::report::{plot, simulation};
use crate::rescore;
use crate::result::ResultFile;
use std::path::Path;
use std::time::Duration;

/// result.json, timing.json (if the time is known), and per trajectory simulation.csv and plot.svg (numbered if there are several). Files that
/// another number of trajectories left there are removed.
pub fn files(
    folder: &Path,
    result: &ResultFile,
    cases: &[Case],
    loaded: &[Loaded],
    elapsed: Option<Duration>,
) -> anyhow::Result<()> {
    let mut change = Change::begin(folder)?;
    let before = of_calibration(folder);
    if let Some(elapsed) = elapsed {
        let seconds = elapsed.as_secs_f64();
        let timing = serde_json::json!({
            "schema_version": result.schema_version,
            "wall_s": seconds,
            "threads": rayon::current_num_threads(),
            "evaluations_per_s": result.evaluations as f64 / seconds,
        });
        change.write("timing.json", (serde_json::to_string_pretty(&timing)? + "\n").as_bytes())?;
    }

    for (i, (case, one)) in cases.iter().zip(loaded).enumerate() {
        let suffix = suffix(i, loaded.len());
        let mut trace = Trace::default();
        let outcome = rescore::outcome(case, &result.parameters_on(i)?, &mut trace)?;
        let t = &one.trajectory.t;
        let mut csv = Vec::new();
        simulation::write_csv(&mut csv, t, case, &trace)?;
        change.write(&format!("simulation{suffix}.csv"), &csv)?;
        let title = format!("{}, {}: variant {}", case.label, one.trajectory.name, result.numbered_model());
        let svg = plot::draw(&title, plot::AHEAD, t, case, &trace, &outcome)?;
        change.write(&format!("plot{suffix}.svg"), svg.as_bytes())?;
    }
    change.write(RESULT, result.to_json().as_bytes())?;
    finish(change, folder, before)
}
