//! Root mean square of the relative error; NaN where no measured sample is above [`STANDSTILL`](super::super::STANDSTILL).

use super::{ALL, Accumulation, Measure};

pub const MEASURE: Measure = Measure {
    name: "rmspe",
    mark: "",
    signals: ALL,
    meaning: "root mean square of the relative error",
    has_unit: false,
    sums: Accumulation::Relative,
    count: |measured| measured.relative_count,
    magnitude: |_| 1.0,
    value: |signal| signal.rmspe,
};
