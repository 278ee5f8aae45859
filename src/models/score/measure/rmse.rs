//! Root mean square error, in the signal's unit.

use super::{ALL, Accumulation, Measure};

pub const MEASURE: Measure = Measure {
    name: "rmse",
    mark: "",
    signals: ALL,
    meaning: "root mean square error",
    has_unit: true,
    sums: Accumulation::Squared,
    count: |measured| measured.count,
    magnitude: |_| 1.0,
    value: |signal| signal.rmse,
};
