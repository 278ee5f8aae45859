//! RMSE over the range (largest minus smallest) of the measured signal, from the floored speed.

use super::{Accumulation, Measure};
use crate::score::Measured;

pub const MEASURE: Measure = Measure {
    name: "rmse",
    mark: "n",
    signals: &["sv", "sva"],
    meaning: "RMSE over the range of the measured signal",
    has_unit: false,
    sums: Accumulation::Floored,
    count: |measured| measured.count,
    magnitude: Measured::range,
    value: |signal| signal.rmse_n,
};
