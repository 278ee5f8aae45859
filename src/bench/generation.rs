//! What a generation of an optimiser costs beside simulating: breeding, laying candidates out, dispatching, sorting.

use super::contender::{Contender, Runner};
use super::{BenchError, Drive};
use crate::calibrate::{Calibration, OptimizerKind, Stop, calibrate};
use crate::catalog::Variant;
use crate::score::GoodnessOfFit;
use serde::Serialize;
use std::ops::ControlFlow;
use std::time::Instant;

/// Samples of a drive on which simulating takes no time worth mentioning.
const SHORT: usize = 20;

/// Generations that are timed, after as many that warm up.
const GENERATIONS: usize = 100;

/// A calibration of IDM on a drive that is cut to a few samples, so that nothing but the cost around simulating is left.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Generation {
    /// As in a row.
    pub evaluator: &'static str,
    /// As in a row.
    pub precision: &'static str,
    /// Members of a generation of the optimiser.
    pub population: usize,
    /// Samples of the drive.
    pub steps: usize,
    /// Wall time of every generation \[s\].
    pub wall_s: Vec<f64>,
}

impl Generation {
    /// Measures; `None` where the machine has no device.
    pub(super) fn measure(contender: Contender, drive: &Drive) -> Result<Option<Generation>, BenchError> {
        let short = drive.cut(SHORT);
        let variant = Variant::from_id(1)?;
        let runner = contender.runner(&short.case(variant)?, GoodnessOfFit::NRMSE_SVA)?;
        let Some(mut evaluator) = runner.and_then(Runner::into_evaluator) else { return Ok(None) };
        let stop = Stop { max_evaluations: u64::MAX, max_stall: u64::MAX, ..Stop::default() };
        let settings = Calibration { optimizer: OptimizerKind::Ga, stop, ..Calibration::default() };
        let mut ends = Vec::new();
        calibrate(evaluator.as_mut(), &short.space(variant)?, &settings, &mut |_| {
            ends.push(Instant::now());
            if ends.len() > 2 * GENERATIONS { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        let wall_s = ends[GENERATIONS..].windows(2).map(|pair| (pair[1] - pair[0]).as_secs_f64()).collect();
        let (evaluator, precision) = (contender.evaluator(), contender.precision());
        Ok(Some(Generation { evaluator, precision, population: 100, steps: SHORT, wall_s }))
    }
}
