//! The comparison with SUMO, in the report of a calibration.

use super::{Chart, Page, short};
use crate::sumo::{Export, Loss};

/// The section of an export, with its charts.
pub fn sumo(page: &mut Page, export: &Export, charts: Vec<Chart>) {
    page.section("sumo", "In SUMO");
    let version = export.sumo.as_ref().map_or(" It was not run.".to_owned(), |version| {
        format!(
            " SUMO {version} was run behind the measured leader, from the same first state, and compared with leadlag."
        )
    });
    page.paragraph(&format!("Exported as model {} to {}.{version}", export.model, export.file));
    for (what, sentences) in [("Not exported", &export.lost), ("Besides", &export.added)] {
        sentences.iter().for_each(|sentence| page.paragraph(&format!("{what}: {sentence}.")));
    }
    let mut rows = Vec::new();
    for (loss, drive) in export.loss.iter().zip(&export.data) {
        let cell =
            |loss: &Loss| format!("{} (at most {} at {} s)", short(loss.rms), short(loss.largest), short(loss.at_s));
        rows.push(vec![
            format!("{}, follower {}", drive.path, drive.follower),
            cell(&loss.spacing_m),
            cell(&loss.speed_mps),
            cell(&loss.accel_mps2),
            short(loss.nrmse_sva),
            short(loss.sumo_nrmse_sva),
            if loss.collision { "yes" } else { "no" }.to_owned(),
        ]);
    }
    if !rows.is_empty() {
        let head = [
            "drive",
            "rms of spacing [m]",
            "of speed [m/s]",
            "of acceleration [m/s²]",
            "NRMSE(s,v,a) of leadlag",
            "of SUMO",
            "collision in SUMO",
        ];
        page.table("SUMO against leadlag", &head, &rows);
    }
    page.charts("leadlag and SUMO", "drive", charts);
    let rows: Vec<Vec<String>> =
        export.attributes.iter().map(|(name, value)| vec![name.clone(), value.clone()]).collect();
    page.table("Attributes of the vehicle type", &["attribute", "value"], &rows);
}
