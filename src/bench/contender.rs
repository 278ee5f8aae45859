//! What is measured, by name. The one place where evaluators are made.

use super::native::Native;
use crate::evaluator::AdapterChoice;
use crate::evaluator::{Case, EvaluateError, Evaluator, Population, Score, Timings};
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
    /// All that this version has, the ceiling first.
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
    #[must_use]
    pub fn evaluator(self) -> &'static str {
        match self {
            Contender::NativeF32 | Contender::NativeF64 => "native",
            Contender::Reference => "reference",
            Contender::Lanes(_) => "lanes",
            Contender::Gpu(_) => "gpu",
        }
    }

    /// `f32`, `f64`, `plain` or `compensated`.
    #[must_use]
    pub fn precision(self) -> &'static str {
        match self {
            Contender::NativeF32 => "f32",
            Contender::NativeF64 | Contender::Reference => "f64",
            Contender::Lanes(precision) => precision.into_str(),
            Contender::Gpu(precision) => precision.into_str(),
        }
    }

    /// True for the GPU evaluator, software Vulkan included.
    #[must_use]
    pub fn is_gpu(self) -> bool {
        matches!(self, Contender::Gpu(_))
    }

    /// True for the loop that knows one variant only.
    #[must_use]
    pub fn is_native(self) -> bool {
        self.evaluator() == "native"
    }

    /// Makes it for a case, ready to run; `None` where the machine has no device for it.
    ///
    /// # Errors
    /// When the case cannot be laid out or the device fails.
    pub(super) fn runner(self, case: &Case, gof: GoodnessOfFit) -> Result<Option<Runner>, EvaluateError> {
        let cases = vec![case.clone()];
        Ok(Some(match self {
            Contender::NativeF32 => Runner::NativeF32(Native::new(case, &gof)?),
            Contender::NativeF64 => Runner::NativeF64(Native::new(case, &gof)?),
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
    NativeF32(Native<f32>),
    /// The hand-fused loop.
    NativeF64(Native<f64>),
    /// Anything that evaluates.
    Evaluator(Box<dyn Evaluator>),
}

impl Runner {
    /// One score per candidate.
    ///
    /// # Errors
    /// When the evaluator cannot run.
    pub fn run(&mut self, population: &Population, scores: &mut [Score]) -> Result<(), EvaluateError> {
        match self {
            Runner::NativeF32(native) => native.evaluate(population, scores),
            Runner::NativeF64(native) => native.evaluate(population, scores),
            Runner::Evaluator(evaluator) => evaluator.evaluate(population, scores),
        }
    }

    /// Time that went to other things than computing.
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

    /// The device, where there is one.
    pub fn adapter(&self) -> Option<String> {
        match self {
            Runner::Evaluator(evaluator) => evaluator.adapter(),
            _ => None,
        }
    }
}
