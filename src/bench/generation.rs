//! Cost of a generation of an optimiser besides the simulation: breeding, preparing candidates, dispatching, sorting.

use super::contender::{Contender, Runner};
use super::{BenchError, Drive};
use crate::calibrate::{Calibration, OptimizerKind, Stop, calibrate};
use crate::catalog::Variant;
use crate::score::GoodnessOfFit;
use serde::Serialize;
use std::ops::ControlFlow;
use std::time::Instant;

/// Number of samples of a drive whose simulation takes negligible time.
const SHORT: usize = 20;

/// Number of timed generations, after as many for warm-up, if only the cost besides the simulation is requested.
const GENERATIONS: usize = 100;

/// Number of samples of a drive of a minute and a half, on which whole generations of large populations are timed.
const WHOLE: usize = 900;

/// Generations of a large population that are timed, after one that warms up.
const LARGE: usize = 3;

/// Populations that fill a CPU and a GPU.
const POPULATIONS: [usize; 2] = [4096, 65_536];

/// Generations of the genetic algorithm on IDM, from ask to tell.
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
    /// Measures the cost of a generation of the paper's size on a drive of a few samples, so that almost only the cost besides the
    /// simulation remains, and whole generations of large populations. Does nothing without a device.
    pub(super) fn measure(contender: Contender, drive: &Drive) -> Result<Vec<Generation>, BenchError> {
        let large = POPULATIONS.map(|population| (WHOLE, population, 1, LARGE));
        let of = |(steps, population, warm, timed)| Self::one(contender, drive, steps, population, [warm, timed]);
        let all = std::iter::once((SHORT, 100, GENERATIONS, GENERATIONS)).chain(large).map(of);
        Ok(all.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }

    fn one(
        contender: Contender,
        drive: &Drive,
        steps: usize,
        population: usize,
        [warm, timed]: [usize; 2],
    ) -> Result<Option<Generation>, BenchError> {
        let short = drive.cut(steps);
        let variant = Variant::from_id(1)?;
        let runner = contender.runner(&short.case(variant)?, GoodnessOfFit::NRMSE_SVA)?;
        let Some(mut evaluator) = runner.and_then(Runner::into_evaluator) else { return Ok(None) };
        let stop = Stop { max_evaluations: u64::MAX, max_stall: u64::MAX, ..Stop::default() };
        let settings =
            Calibration { optimizer: OptimizerKind::Ga, stop, population: Some(population), ..Calibration::default() };
        let mut ends = Vec::new();
        calibrate(evaluator.as_mut(), &short.space(variant)?, &settings, &mut |_| {
            ends.push(Instant::now());
            if ends.len() > warm + timed { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        let wall_s = ends[warm..].windows(2).map(|pair| (pair[1] - pair[0]).as_secs_f64()).collect();
        let (evaluator, precision) = (contender.evaluator(), contender.precision());
        Ok(Some(Generation { evaluator, precision, population, steps: short.samples(), wall_s }))
    }
}
