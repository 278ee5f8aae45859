//! Theil's inequality coefficient.

use super::{ALL, Accumulation, Measure};

pub const MEASURE: Measure = Measure {
    name: "u",
    mark: "",
    signals: ALL,
    meaning: "Theil's inequality coefficient",
    has_unit: false,
    sums: Accumulation::Theil,
    count: |measured| measured.count,
    magnitude: |_| 1.0,
    value: |signal| signal.u,
};
