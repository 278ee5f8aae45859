//! Results of the evaluators that run the WGSL text, per candidate, before any measure.

use super::{Case, Course, Failure, FailureKind, Job, Outcome};
use crate::score::{Measures, Sums};
use crate::symbols::Parameters;

/// Bits of a status word, as in shaders/kernel.wgsl: 0 for a complete run, else the top bit, the kind, and the sample.
pub mod status {
    /// Set in every status but 0.
    pub const FAILED: u32 = 0x8000_0000;
    /// The spacing is no longer above 0.
    pub const CRASH: u32 = 0;
    /// Gipps' radicand is negative.
    pub const RADICAND: u32 = 1 << 28;
    /// A state is NaN or infinite.
    pub const NOT_FINITE: u32 = 2 << 28;
    /// Bits of the sample.
    pub const STEP: u32 = 0x0fff_ffff;
}

/// Status, cuts and sums of one run; the sums are copies of the evaluator's, in its own precision.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Raw {
    /// See [`status`].
    pub status: u32,
    /// Steps clipped at the upper acceleration bound.
    pub n_cut_acc: u32,
    /// Steps clipped at the lower acceleration bound.
    pub n_cut_dec: u32,
    /// Σ (simulated - measured)² of spacing, speed and acceleration.
    pub error2: [f64; 3],
    pub simulated2: [f64; 3],
    /// Σ ((simulated - measured) / denominator)².
    pub relative2: [f64; 3],
    /// Σ (simulated - denominator)² of the speed.
    pub floored2_v: f64,
}

impl Raw {
    /// Why the run ended early; `None` for a complete run.
    pub fn failure(&self) -> Option<Failure> {
        if self.status == 0 {
            return None;
        }
        let kind = match self.status & !(status::FAILED | status::STEP) {
            status::RADICAND => FailureKind::Radicand,
            status::NOT_FINITE => FailureKind::NotFinite,
            _ => FailureKind::Crash,
        };
        Some(Failure { kind, step: (self.status & status::STEP) as usize })
    }

    /// The outcomes of the candidates of jobs, from their results in the same order.
    pub(crate) fn outcomes(raw: &[Raw], jobs: &[Job<'_>], cases: &[Case], courses: &[Course]) -> Vec<Outcome> {
        let candidates = jobs.iter().flat_map(|job| (0..job.population.len()).map(move |i| (job, i)));
        let outcome = |(raw, (job, i)): (&Raw, (&Job<'_>, usize))| {
            raw.outcome(&cases[job.case], &courses[job.case], &job.population.parameters(i))
        };
        raw.iter().zip(candidates).map(outcome).collect()
    }

    /// The outcome; the measures are finished in f64.
    pub fn outcome(&self, case: &Case, course: &Course, parameters: &Parameters) -> Outcome {
        let pace = case.pace(parameters);
        let measured = course.measured(pace.first);
        let sums = |i: usize| Sums {
            error2: self.error2[i],
            error2_floored: if i == 1 { self.floored2_v } else { self.error2[i] },
            simulated2: self.simulated2[i],
            relative2: self.relative2[i],
        };
        let result = match self.failure() {
            Some(failure) => Err(failure),
            None => Ok(Measures([0, 1, 2].map(|i| measured[i].measures(&sums(i))))),
        };
        Outcome { result, delay_steps: pace.delay_steps, n_cut_acc: self.n_cut_acc, n_cut_dec: self.n_cut_dec }
    }
}
