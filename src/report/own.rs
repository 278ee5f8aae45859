//! The table of the parameters that drivers have of their own.

use super::html::short;
use crate::result::{OwnParameter, ResultFile};

/// Its columns.
pub const HEAD: [&str; 6] = ["own parameter", "middle", "95 %", "spread", "95 %", "drivers"];

/// A row per parameter: its middle and its standard deviation over the drivers, with intervals, and the range of the drivers.
#[must_use]
pub fn rows(result: &ResultFile) -> Vec<Vec<String>> {
    let between = |ends: [String; 2]| format!("{} to {}", ends[0], ends[1]);
    let row = |(name, own): (&String, &OwnParameter)| {
        let unit = result.units.get(name).map_or("", String::as_str);
        let spread = |x: f64| if own.logarithm { format!("{} %", short(100.0 * x)) } else { short(x) };
        let drivers = result.own.iter().flat_map(|own| &own.drivers);
        let values = drivers.filter_map(|driver| driver.parameters.get(name).copied());
        let range = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        vec![
            if unit == "-" { name.clone() } else { format!("{name} [{unit}]") },
            short(own.middle),
            between(own.middle_interval.map(short)),
            spread(own.spread),
            between(own.spread_interval.map(spread)),
            between(range.map(short)),
        ]
    };
    result.own.iter().flat_map(|own| &own.parameters).map(row).collect()
}
