//! The error budget: by signal, driving state, frequency, speed and place.

use super::{Page, short};
use crate::diagnose::describe::error_breakdown::{Budget, Share};

/// Adds the whole budget; `whose` names the simulation.
pub(super) fn budget(page: &mut Page, budget: &Budget, whose: &str) {
    let ([s, v, a], [bias_s, bias_v, bias_a]) = (budget.rms.map(short), budget.bias.map(short));
    page.paragraph(&format!(
        "{whose}, root mean square: spacing {s} m, speed {v} m/s, acceleration {a} m/s²; mean (simulated minus measured): {bias_s} m, \
         {bias_v} m/s, {bias_a} m/s². Below: the share of each class of the squared error, beside its share of the time; look at classes \
         with a larger share of the error than of the time."
    ));
    let divisions = [
        ("Error by driving state", "while", &budget.regime),
        ("Error by frequency", "frequency", &budget.frequency),
        ("Error by speed", "speed", &budget.speed),
        ("Error by place on the road", "place", &budget.place),
        ("Error by time", "when", &budget.time),
    ];
    page.raw("<div class=\"beside\">");
    for (caption, class, shares) in divisions {
        let percent = |x: f64| format!("{:.0} %", 100.0 * x);
        let row = |share: &Share| {
            let [s, v, a] = share.error.map(percent);
            vec![share.name.clone(), share.time.map_or("–".to_owned(), percent), s, v, a]
        };
        let of = |row: usize, column: usize| match column {
            1 => shares[row].time,
            2..=4 => Some(shares[row].error[column - 2]),
            _ => None,
        };
        let head = [class, "time", "spacing", "speed", "acceleration"];
        page.table_with(caption, &head, &shares.iter().map(row).collect::<Vec<_>>(), &of);
    }
    page.raw("</div>");
}
