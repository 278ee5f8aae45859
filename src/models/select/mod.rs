//! Choice of the evaluator: the requested one, or under `auto` the suitable one.

#[cfg_attr(not(feature = "gpu"), path = "no_device.rs")]
pub mod device;

use crate::evaluator::{AdapterChoice, Case, EvaluateError, Evaluator, Fallback, Splitting};
use crate::lanes::{Lanes, LanesPrecision};
use crate::reference::Reference;
use crate::score::GoodnessOfFit;
use crate::text::option::{EVALUATOR, GPU, PRECISION};
use crate::text::spelling::UnknownWord;
use crate::wgsl::Precision;
use device::Device;

/// An evaluator by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::EnumString, strum::IntoStaticStr, strum::VariantNames)]
#[strum(const_into_str, serialize_all = "snake_case", parse_err_ty = UnknownWord, parse_err_fn = unknown)]
pub enum Kind {
    /// The WGSL text on the CPU, in blocks of candidates.
    Lanes,
    /// Plain scalar f64 on the CPU.
    Reference,
    /// The WGSL text on a GPU, including lavapipe; never replaced by the CPU evaluator.
    Gpu,
    /// A hardware GPU if there is one and the work is large enough for it, otherwise `lanes`.
    #[default]
    Auto,
}

fn unknown(found: &str) -> UnknownWord {
    UnknownWord::of::<Kind>("evaluator", found)
}

/// The evaluator, its precision and its device.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Selection {
    /// The evaluator.
    pub kind: Kind,
    /// Its precision; `None`: plain f32 for `lanes` and `gpu`.
    pub precision: Option<LanesPrecision>,
    /// The device of `gpu`.
    pub adapter: AdapterChoice,
}

/// A choice that contradicts itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SelectionError {
    #[error("{PRECISION} needs {EVALUATOR} lanes or gpu; the reference computes in f64")]
    Reference,
    #[error("{PRECISION} f64 needs {EVALUATOR} lanes; on a GPU there are plain and compensated f32")]
    GpuF64,
    #[error("{GPU} needs {EVALUATOR} gpu or auto")]
    Adapter,
}

/// Kind and size of the work, for `auto`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Work {
    /// Candidates that are simulated at a time, over all cases.
    pub candidates: usize,
    /// The default precision.
    pub precision: LanesPrecision,
}

/// Number of candidates from which a discrete GPU is used. A generation of any size takes it at least 2 to 4 ms, because its steps follow
/// one another. On an NVIDIA H200 beside 16 threads, IDM over 9,227 samples, the two are equal at some 500 candidates, and with 4,096 the
/// GPU is three times as fast (`leadlag bench`, docs/PERFORMANCE.md). The number of threads has no influence, because results must not
/// depend on it.
const FOR_A_DISCRETE_GPU: usize = 2_000;

/// The same for any other GPU: one that shares memory and power with the CPU, or a part of one. This is an estimate; none has been
/// measured.
const FOR_ANOTHER_GPU: usize = 10_000;

impl Selection {
    /// Checks that evaluator, precision and device fit together.
    pub fn check(&self) -> Result<(), SelectionError> {
        match self.kind {
            Kind::Reference if self.precision.is_some() => Err(SelectionError::Reference),
            Kind::Gpu if self.precision == Some(LanesPrecision::F64) => Err(SelectionError::GpuF64),
            Kind::Reference | Kind::Lanes if self.adapter != AdapterChoice::Best => Err(SelectionError::Adapter),
            _ => Ok(()),
        }
    }

    /// Makes the evaluator. Under `auto`, `lanes` replaces a device that fails later; `warn` receives the reason at the start or at the failure, and
    /// also if an adapter that was requested by name is not used. Fails when the evaluator cannot be made, or there is no adapter of the requested
    /// name.
    pub fn build(
        &self,
        cases: Vec<Case>,
        gof: GoodnessOfFit,
        work: Work,
        warn: fn(&str),
    ) -> Result<Box<dyn Evaluator>, EvaluateError> {
        let f32_precision = match self.precision {
            Some(LanesPrecision::Compensated) => Precision::Compensated,
            _ => Precision::Plain,
        };
        match self.kind {
            Kind::Reference => Ok(Box::new(Reference::new(cases, gof))),
            Kind::Lanes => Ok(Box::new(Lanes::new(cases, gof, self.precision.unwrap_or_default())?)),
            Kind::Gpu => Ok(Box::new(Splitting::new(device::open(cases, gof, f32_precision, &self.adapter)?))),
            Kind::Auto => {
                let precision = self.precision.unwrap_or(work.precision);
                let named = self.named()?;
                let lanes = move |cases| -> Result<Box<dyn Evaluator>, EvaluateError> {
                    Ok(Box::new(Lanes::new(cases, gof, precision)?))
                };
                if let Some(reason) = self.against_a_gpu(precision, work) {
                    if let Some(Device { name, .. }) = named {
                        warn(&format!("{GPU}: {name} is not used: {reason}; {EVALUATOR} gpu would use it, in f32"));
                    }
                    return lanes(cases);
                }
                match device::open(cases.clone(), gof, f32_precision, &self.adapter) {
                    Ok(gpu) => Ok(Box::new(Fallback::new(
                        Box::new(Splitting::new(gpu)),
                        Box::new(move |error, cases| {
                            warn(&format!("{error}; continuing with the CPU evaluator"));
                            lanes(cases)
                        }),
                    ))),
                    Err(error) => {
                        warn(&format!("{error}; using the CPU evaluator"));
                        lanes(cases)
                    }
                }
            }
        }
    }

    /// The adapter requested by name.
    fn named(&self) -> Result<Option<Device>, EvaluateError> {
        let is_named = self.adapter != AdapterChoice::Best;
        is_named.then(|| device::find(&self.adapter)).transpose()
    }

    /// Why `auto` uses no GPU; `None` if there is a hardware GPU, and enough work for it.
    fn against_a_gpu(&self, precision: LanesPrecision, work: Work) -> Option<&'static str> {
        const SMALL: Option<&str> = Some("the work is too small for a GPU to be faster");
        if precision == LanesPrecision::F64 {
            return Some("this is computed in f64, on the CPU");
        }
        // Before any query to a driver, which takes time.
        if work.candidates < FOR_A_DISCRETE_GPU {
            return SMALL;
        }
        if device::is_switched_off() {
            return Some("LEADLAG_NO_GPU is set");
        }
        match device::find(&self.adapter) {
            Ok(device) if device.is_discrete => None,
            Ok(device) if device.is_hardware => SMALL.filter(|_| work.candidates < FOR_ANOTHER_GPU),
            _ => Some("it is software, and the CPU alone is faster"),
        }
    }
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;

    #[test]
    fn an_adapter_that_is_not_there_is_an_error_under_auto_however_small_the_work_is() {
        let adapter = AdapterChoice::Named("no such card".to_owned());
        let selection = Selection { adapter, ..Selection::default() };
        for precision in [LanesPrecision::Plain, LanesPrecision::F64] {
            let work = Work { candidates: 1, precision };
            let built = selection.build(Vec::new(), GoodnessOfFit::NRMSE_SVA, work, |_| {});
            assert!(matches!(built, Err(EvaluateError::Adapter { .. })), "{precision:?}");
        }
    }
}
