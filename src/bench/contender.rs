//! The contenders of a measurement, by name. Evaluators of the benchmark are made only here.

use crate::by_hand::ByHand;
use crate::evaluator::{AdapterChoice, Case, EvaluateError, Evaluator, Population, Score, Timings};
use crate::lanes::{Lanes, LanesPrecision};
use crate::reference::Reference;
use crate::score::GoodnessOfFit;
use crate::select::device;
use crate::wgsl::Precision;

/// Something that simulates candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Contender {
    /// The hand-fused IDM loop in f32.
    NativeF32,
    /// The hand-fused IDM loop in f64.
    NativeF64,
    /// The scalar reference, f64.
    Reference,
    /// The vectorised CPU evaluator.
    Lanes(LanesPrecision),
    /// The GPU evaluator on the best adapter.
    Gpu(Precision),
}

impl Contender {
    /// All of this version, the hand-written loops first.
    pub const ALL: &'static [Contender] = &[
        Contender::NativeF32,
        Contender::NativeF64,
        Contender::Lanes(LanesPrecision::Plain),
        Contender::Lanes(LanesPrecision::Compensated),
        Contender::Lanes(LanesPrecision::F64),
        Contender::Gpu(Precision::Plain),
        Contender::Gpu(Precision::Compensated),
        Contender::Reference,
    ];

    /// `native`, `reference`, `lanes` or `gpu`.
    pub fn evaluator(self) -> &'static str {
        match self {
            Contender::NativeF32 | Contender::NativeF64 => "native",
            Contender::Reference => "reference",
            Contender::Lanes(_) => "lanes",
            Contender::Gpu(_) => "gpu",
        }
    }

    /// `f32`, `f64`, `plain` or `compensated`.
    pub fn precision(self) -> &'static str {
        match self {
            Contender::NativeF32 => "f32",
            Contender::NativeF64 | Contender::Reference => "f64",
            Contender::Lanes(precision) => precision.into_str(),
            Contender::Gpu(precision) => precision.into_str(),
        }
    }

    /// True for the GPU evaluator, software Vulkan included.
    pub fn is_gpu(self) -> bool {
        matches!(self, Contender::Gpu(_))
    }

    /// True for the loop that supports only one variant.
    pub fn is_native(self) -> bool {
        self.evaluator() == "native"
    }

    /// Makes it for a case, ready to run; `None` if the machine has no device for it. Fails if the case cannot be prepared or the device fails.
    pub(super) fn runner(self, case: &Case, gof: GoodnessOfFit) -> Result<Option<Runner>, EvaluateError> {
        let cases = vec![case.clone()];
        Ok(Some(match self {
            Contender::NativeF32 => Runner::ByHand(ByHand::f32(case, &gof)?),
            Contender::NativeF64 => Runner::ByHand(ByHand::f64(case, &gof)?),
            Contender::Reference => Runner::Evaluator(Box::new(Reference::new(cases, gof))),
            Contender::Lanes(precision) => Runner::Evaluator(Box::new(Lanes::new(cases, gof, precision)?)),
            Contender::Gpu(_) if device::is_switched_off() => return Ok(None),
            Contender::Gpu(precision) => match device::open(cases, gof, precision, &AdapterChoice::Best) {
                Err(EvaluateError::Adapter { .. } | EvaluateError::AddressSpace { .. } | EvaluateError::NoGpuBuilt) => {
                    return Ok(None);
                }
                gpu => Runner::Evaluator(gpu?),
            },
        }))
    }
}

/// True if the GPU evaluator runs on hardware here.
pub(super) fn has_hardware() -> bool {
    !device::is_switched_off() && device::find(&AdapterChoice::Best).is_ok_and(|device| device.is_hardware)
}

/// A contender ready to run on one case.
pub(super) enum Runner {
    /// The hand-fused loop.
    ByHand(ByHand),
    /// Anything that evaluates.
    Evaluator(Box<dyn Evaluator>),
}

impl Runner {
    /// One score per candidate. Fails when the evaluator cannot run.
    pub fn run(&mut self, population: &Population, scores: &mut [Score]) -> Result<(), EvaluateError> {
        match self {
            Runner::ByHand(loops) => loops.evaluate(population, scores),
            Runner::Evaluator(evaluator) => evaluator.evaluate(population, scores),
        }
    }

    /// Time spent on other work than computing.
    pub fn timings(&self) -> Timings {
        match self {
            Runner::Evaluator(evaluator) => evaluator.timings(),
            _ => Timings::default(),
        }
    }

    /// The evaluator, unless it is the hand-fused loop.
    pub fn into_evaluator(self) -> Option<Box<dyn Evaluator>> {
        match self {
            Runner::Evaluator(evaluator) => Some(evaluator),
            _ => None,
        }
    }

    /// The device, if any.
    pub fn adapter(&self) -> Option<String> {
        match self {
            Runner::Evaluator(evaluator) => evaluator.adapter(),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Contender;
    use crate::bench::{Drive, candidates};
    use crate::catalog::Variant;
    use crate::evaluator::Score;
    use crate::score::GoodnessOfFit;

    // Measured: 3e-6 and 3e-13. A loop to compare with must compute the same.
    #[test]
    fn the_loop_by_hand_computes_what_the_reference_computes() {
        let drive = Drive::synthetic().expect("the scenario is fixed");
        let variant = Variant::from_id(1).expect("variant 1 exists");
        let case = drive.case(variant).expect("the drive has all that a variant needs");
        // The last block is not full.
        let population = candidates(&drive.space(variant).expect("Table 3 has bounds"), 131);
        let scores = |contender: Contender| {
            let mut scores = vec![Score::Rejected; population.len()];
            let runner = contender.runner(&case, GoodnessOfFit::NRMSE_SVA).expect("the case can be laid out");
            runner.expect("it needs no device").run(&population, &mut scores).expect("it evaluates");
            scores
        };
        let expected = scores(Contender::Reference);
        for (contender, close) in [(Contender::NativeF32, 2e-5), (Contender::NativeF64, 1e-11)] {
            for pair in scores(contender).iter().zip(&expected) {
                let difference = match pair {
                    (Score::Value(found), Score::Value(expected)) => (found / expected - 1.0).abs(),
                    (Score::Failed(_), Score::Failed(_)) => 0.0,
                    _ => f64::INFINITY,
                };
                assert!(difference < close, "{}: {difference:e}", contender.precision());
            }
        }
    }
}
