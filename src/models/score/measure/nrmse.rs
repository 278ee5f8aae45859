//! RMSE over the root mean square of the measured signal (Eq. 18).

use super::{ALL, Accumulation, Measure};
use crate::score::Measured;

pub const MEASURE: Measure = Measure {
    name: "nrmse",
    mark: "",
    signals: ALL,
    meaning: "RMSE over the root mean square of the measured signal",
    has_unit: false,
    sums: Accumulation::Squared,
    count: |measured| measured.count,
    magnitude: Measured::rms,
    value: |signal| signal.nrmse,
};
