//! The worst fits, sample by sample, because a table of numbers does not show their faults.

use super::work::task;
use super::{Pair, Row, Settings};
use crate::evaluator::EvaluateError;
use crate::reference::Trace;
use crate::rescore;
use crate::study::table::Table;

/// Number of fits kept.
const KEPT: usize = 12;

/// The rows with the highest scores of the first measure, each pair with the model that fits it best, the worst first.
#[must_use]
pub fn worst(rows: &[Row]) -> Vec<&Row> {
    let mut best: Vec<(f64, &Row)> = Vec::new();
    for row in rows.iter().filter(|row| row.place.measure == 0) {
        let Ok(found) = &row.found else { continue };
        match best.last_mut() {
            Some((score, last)) if last.place.pair == row.place.pair => {
                if found.score < *score {
                    (*score, *last) = (found.score, row);
                }
            }
            _ => best.push((found.score, row)),
        }
    }
    best.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.place.cmp(&b.1.place)));
    best.into_iter().take(KEPT).map(|(_, row)| row).collect()
}

/// Their measured and simulated signals, one fit after the other.
///
/// # Errors
/// When a simulation in f64 cannot run.
pub fn fits(pairs: &[Pair], settings: &Settings, rows: &[Row]) -> Result<Table, EvaluateError> {
    let mut pair = Vec::new();
    let mut signals: [Vec<f64>; 6] = Default::default();
    for row in worst(rows) {
        let (Ok(task), Ok(found), Ok(drive)) =
            (task(pairs, settings, row.place), &row.found, &pairs[row.place.pair].drive)
        else {
            continue;
        };
        let mut trace = Trace::default();
        rescore::outcome(&task.case, &task.space.parameters(&found.parameters), &mut trace)?;
        let of = [
            &drive.trajectory.t,
            &task.case.s.to_vec(),
            &trace.s,
            &task.case.v_f.to_vec(),
            &trace.v,
            &drive.trajectory.v_l,
        ]
        .map(Clone::clone);
        let count = of.iter().map(Vec::len).min().unwrap_or(0);
        pair.extend(std::iter::repeat_n(row.place.pair + 1, count));
        for (all, own) in signals.iter_mut().zip(&of) {
            all.extend_from_slice(&own[..count]);
        }
    }
    let mut table = Table::default();
    table.integer("pair", pair.iter().map(|pair| i64::try_from(*pair).ok()));
    let names = ["time_s", "spacing_m", "sim_spacing_m", "speed_mps", "sim_speed_mps", "lead_speed_mps"];
    for (name, signal) in names.into_iter().zip(&signals) {
        table.number(name, signal.iter().map(|x| Some(*x)));
    }
    Ok(table)
}
