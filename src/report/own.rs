//! The table of the own parameters of the drivers.

use super::html::short;
use crate::result::{OwnParameter, ResultFile};

/// Its columns.
pub const HEAD: [&str; 6] = ["own value", "middle", "95 %", "spread", "95 %", "drivers"];

/// Widths of all columns but the first in a terminal of 80.
pub const WIDTHS: [usize; 5] = [6, 16, 7, 16, 17];

/// A row per parameter: its middle and its standard deviation over the drivers, with intervals, and the range of the drivers.
pub fn rows(result: &ResultFile) -> Vec<Vec<String>> {
    let between = |ends: [String; 2]| format!("{} to {}", ends[0], ends[1]);
    let row = |(name, own): (&String, &OwnParameter)| {
        let unit = result.units.get(name).map_or("", String::as_str);
        let (factor, percent) = if own.logarithm { (100.0, " %") } else { (1.0, "") };
        let spread = |x: f64| short(factor * x);
        let drivers = result.own.iter().flat_map(|own| &own.drivers);
        let values = drivers.filter_map(|driver| driver.parameters.get(name).copied());
        let range = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        vec![
            if unit == "-" { name.clone() } else { format!("{name} [{unit}]") },
            short(own.middle),
            between(own.middle_interval.map(short)),
            spread(own.spread) + percent,
            between(own.spread_interval.map(spread)) + percent,
            between(range.map(short)),
        ]
    };
    result.own.iter().flat_map(|own| &own.parameters).map(row).collect()
}
