//! The error budget: by signal and driving state.

use super::{Page, short};
use crate::diagnose::describe::error_breakdown::{Budget, Share};

/// Adds the whole budget; `whose` names the simulation.
pub(super) fn budget(page: &mut Page, budget: &Budget, whose: &str) {
    let ([s, v, a], [bias_s, bias_v, bias_a]) = (budget.rms.map(short), budget.bias.map(short));
    page.paragraph(&format!(
        "{whose}, root mean square: spacing {s} m, speed {v} m/s, acceleration {a} m/s²; mean (simulated minus measured): {bias_s} m, \
         {bias_v} m/s, {bias_a} m/s². Below: the share of each state of the squared error, beside its share of the time; look at states \
         with a larger share of the error than of the time."
    ));
    let percent = |x: f64| format!("{:.0} %", 100.0 * x);
    let row = |share: &Share| {
        let [s, v, a] = share.error.map(percent);
        vec![share.name.clone(), percent(share.time), s, v, a]
    };
    let of = |row: usize, column: usize| match column {
        1 => Some(budget.regime[row].time),
        2..=4 => Some(budget.regime[row].error[column - 2]),
        _ => None,
    };
    let head = ["while", "time", "spacing", "speed", "acceleration"];
    let rows: Vec<Vec<String>> = budget.regime.iter().map(row).collect();
    page.table_with("Error by driving state", &head, &rows, &of);
}
