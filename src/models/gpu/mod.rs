//! The WGSL text itself on a GPU, by wgpu: one invocation simulates one candidate.
//!
//! `adapter` selects one, `device` opens it; `kernel` composes the text; `tables` uploads the cases; `plan` prepares jobs; `context` builds
//! pipelines and runs chunks of time on the buffers of `part_buffers`; `summing` adds up products of differences there, for `derivatives`;
//! `results` interprets the results; [`Gpu`] is the evaluator.

mod adapter;
mod context;
mod derivatives;
mod device;
mod kernel;
mod own_functions;
mod part_buffers;
mod plan;
mod probe;
mod rate;
mod results;
mod summing;
mod tables;

pub use crate::evaluator::AdapterChoice;
pub use adapter::Adapter;
pub use adapter::is_switched_off;
pub use device::Limits;
pub use kernel::kernel_text;
pub use own_functions::CpuFunctions;
pub use probe::{Mode, Probe, ProbeStatus, modes, probes, values};

use crate::convention::{self, BoundRule};
use crate::evaluator::{
    BufferSet, Case, Course, Differences, EvaluateError, Evaluator, Job, Observed, Observer, Outcome, Raw, Score,
    Slopes, Timings,
};
use crate::score::GoodnessOfFit;
use crate::wgsl::{Precision, Recipe, ShaderError, check};
use context::Context;
use device::Fault;
use kernel::{Kernel, RAW_WORDS, SMALLEST_WORKGROUP, Sums, Windows, summing_source};
use plan::{Leaves, Plan, Work, most_candidates};
use results::{Results, for_each_candidate, raw_of, score_of};
use std::time::Duration;

/// The third buffer set, for outcomes and raw sums, so that both others may be in flight.
const OWN: usize = 2;

/// The GPU evaluator of one variant over one or several cases.
#[derive(Debug)]
pub struct Gpu {
    cases: Vec<Case>,
    courses: Vec<Course>,
    gof: GoodnessOfFit,
    precision: Precision,
    choice: AdapterChoice,
    limits: Limits,
    adapter: String,
    is_hardware: bool,
    /// `None` after a device was lost and could not be replaced.
    context: Option<Context>,
    /// Work in flight of each buffer set.
    work: [Option<Work>; 3],
    /// Plans for reuse.
    spare: [Plan; 3],
    results: Results,
    /// Time spent besides computing on devices that failed.
    spent: Timings,
    /// Number of devices to destroy as soon as they are opened (tests).
    doomed: u32,
}

impl Gpu {
    /// An evaluator of these cases on the chosen adapter; the score is the mean of `gof` over the cases. Fails without a fitting adapter, for a case
    /// that cannot be laid out, and when the device fails. Panics without cases, or if they were prepared for different variants or conventions.
    pub fn new(
        cases: Vec<Case>,
        gof: GoodnessOfFit,
        precision: Precision,
        choice: &AdapterChoice,
    ) -> Result<Gpu, EvaluateError> {
        Gpu::with_limits(cases, gof, precision, choice, Limits::NONE)
    }

    /// As [`Gpu::new`], with lower requests to the device.
    pub fn with_limits(
        cases: Vec<Case>,
        gof: GoodnessOfFit,
        precision: Precision,
        choice: &AdapterChoice,
        limits: Limits,
    ) -> Result<Gpu, EvaluateError> {
        let Case { variant, convention, .. } = cases.first().expect("at least one case");
        assert!(cases.iter().all(|c| c.variant == *variant), "cases of one variant");
        assert!(cases.iter().all(|c| c.convention == *convention), "cases of one convention");
        cases.iter().try_for_each(Case::check_clock)?;
        let courses = cases.iter().map(Course::new).collect::<Result<Vec<_>, _>>()?;
        let mut gpu = Gpu {
            cases,
            courses,
            gof,
            precision,
            choice: choice.clone(),
            limits,
            adapter: String::new(),
            is_hardware: false,
            context: None,
            work: [None, None, None],
            spare: Default::default(),
            results: Results::default(),
            spent: Timings::default(),
            doomed: 0,
        };
        gpu.open()?.map_err(|fault| gpu.failed(fault))?;
        Ok(gpu)
    }

    /// True unless the adapter runs on the CPU.
    pub fn is_hardware(&self) -> bool {
        self.is_hardware
    }

    /// Time spent so far on building kernels and on the first, empty dispatch of each, at which drivers compile.
    pub fn warm_up(&self) -> Duration {
        Duration::from_secs_f64(self.timings().first_dispatch_s)
    }

    /// Buffers and bind groups made on the device so far. A generation makes none, unless it is the largest yet.
    pub fn allocations(&self) -> u64 {
        self.context.as_ref().map_or(0, |context| context.device.made())
    }

    /// Status, cuts and sums of one candidate after the other, in the order of the jobs. Fails when the device fails twice.
    pub fn raw(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Raw>, EvaluateError> {
        self.start(OWN, jobs, Sums::All, &[], Leaves::Nothing)?;
        let work = self.finish(OWN)?;
        let mut raw = vec![Raw::default(); work.plan.positions.len()];
        for_each_candidate(&work, RAW_WORDS, &self.results.words, |position, words| raw[position] = raw_of(words));
        self.spare[OWN] = work.plan;
        Ok(raw)
    }

    /// Runs that are corrected towards the measurement, one observer per candidate, and their sums over blocks of samples. Fails when the device
    /// fails twice. Panics unless there is one observer per candidate, and at least one sample in a block.
    pub fn observed(
        &mut self,
        job: &Job<'_>,
        observers: &[Observer],
        block: usize,
    ) -> Result<Vec<Observed>, EvaluateError> {
        assert_eq!(job.population.len(), observers.len(), "one observer per candidate");
        assert!(block > 0, "blocks of at least one sample");
        let count = self.courses[job.case].samples().div_ceil(block) as u32;
        self.start(OWN, &[*job], Sums::All, observers, Leaves::Blocks { samples: block as u32, count })?;
        let work = self.finish(OWN)?;
        let empty = Observed { raw: Raw::default(), blocks: Vec::new() };
        let mut observed = vec![empty; work.plan.positions.len()];
        for_each_candidate(&work, RAW_WORDS, &self.results.words, |position, words| {
            observed[position].raw = raw_of(words);
        });
        for_each_candidate(&work, work.leaves.words(), &self.results.blocks, |position, words| {
            let words: Vec<f64> = words.map(|word| f64::from(f32::from_bits(word))).collect();
            observed[position].blocks = words.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        });
        self.spare[OWN] = work.plan;
        Ok(observed)
    }

    /// True if the device has finished all submitted work; for tests.
    #[doc(hidden)]
    pub fn is_idle(&self) -> bool {
        self.context.as_ref().is_none_or(|context| context.device.is_idle())
    }

    /// True if both run on the same device; for tests.
    #[doc(hidden)]
    pub fn shares_device_with(&self, other: &Gpu) -> bool {
        let devices = self.context.as_ref().zip(other.context.as_ref());
        devices.is_some_and(|(own, other)| own.device.raw == other.device.raw)
    }

    /// Destroys the device, as a crashing driver would; for tests. They lower some limit, so that other evaluators do not share the device,
    /// unless they test that.
    #[doc(hidden)]
    pub fn destroy_device(&mut self) {
        if let Some(context) = &self.context {
            context.device.raw.destroy();
        }
    }

    /// Replaces the text of one shader file, until the device is lost; for mutation tests. If the kernels that are then composed are not valid,
    /// nothing is replaced.
    #[doc(hidden)]
    pub fn replace_shader(&mut self, file: &str, text: &str) -> Result<(), ShaderError> {
        let replaced = [(file.to_owned(), text.to_owned())].into();
        check(&self.kernel(Sums::All, true).source(&replaced))?;
        check(&summing_source(SMALLEST_WORKGROUP, &replaced))?;
        if let Some(context) = &mut self.context {
            context.replace(replaced);
        }
        Ok(())
    }

    /// Destroys the next devices as soon as they are opened; for tests, as above.
    #[doc(hidden)]
    pub fn doom(&mut self, devices: u32) {
        self.doomed = devices;
    }

    fn kernel(&self, sums: Sums, observer: bool) -> Kernel {
        let Case { variant, convention, .. } = &self.cases[0];
        // All invocations are at the same sample; only trajectories and the start of a run with delay differ.
        let is_together =
            self.cases.len() == 1 && !(variant.perceives_late() && convention.delay == convention::Delay::Floor);
        // A ring that is longer than necessary costs no time.
        let ring = self.courses.iter().map(|course| course.ring).max().unwrap_or(1).next_power_of_two();
        Kernel {
            recipe: Recipe {
                variant: *variant,
                precision: self.precision,
                radicand: convention.radicand,
                observed: observer,
            },
            sums,
            leaves: false,
            reject: convention.bounds == BoundRule::Reject,
            ring: ring as u32,
            windows: if is_together { Windows::Present } else { Windows::Nothing },
            workgroup: SMALLEST_WORKGROUP,
        }
    }

    /// Opens a device; the outer error means that there is no adapter.
    fn open(&mut self) -> Result<Result<(), Fault>, EvaluateError> {
        self.give_up();
        let adapter = Adapter::choose(&self.choice)?;
        self.adapter = adapter.name();
        self.is_hardware = adapter.is_hardware();
        Ok(Context::open(&adapter, self.limits, &self.courses, &self.gof).map(|context| {
            if self.doomed > 0 {
                self.doomed -= 1;
                context.device.raw.destroy();
            }
            self.context = Some(context);
        }))
    }

    fn opened(&mut self) -> Result<&mut Context, Fault> {
        self.context.as_mut().ok_or_else(|| Fault::new("opening the device", "it was lost"))
    }

    fn failed(&self, fault: Fault) -> EvaluateError {
        if fault.is_memory {
            return EvaluateError::Memory { adapter: self.adapter.clone(), message: fault.message };
        }
        EvaluateError::Device { doing: fault.doing, adapter: self.adapter.clone(), message: fault.message }
    }

    /// Runs an operation on the device. After a failure, runs it once more on a new device, on which all work in flight is repeated.
    fn twice(&mut self, mut run: impl FnMut(&mut Gpu) -> Result<(), Fault>) -> Result<(), EvaluateError> {
        let Err(fault) = run(self) else { return Ok(()) };
        if fault.is_memory {
            // The work would not fit the second time either; its memory is freed with the device.
            self.give_up();
            return Err(self.failed(fault));
        }
        if let Some(context) = &self.context {
            context.device.retire();
        }
        let mut again = self.open()?;
        for set in 0..self.work.len() {
            again = again.and_then(|()| match (&mut self.context, &self.work[set]) {
                (Some(context), Some(work)) => context.start(set, work),
                _ => Ok(()),
            });
        }
        again.and_then(|()| run(self)).map_err(|fault| {
            self.give_up();
            self.failed(fault)
        })
    }

    /// Drops the device and keeps its times.
    fn give_up(&mut self) {
        self.spent = self.timings();
        self.context = None;
    }

    fn start(
        &mut self,
        set: usize,
        jobs: &[Job],
        sums: Sums,
        observers: &[Observer],
        leaves: Leaves,
    ) -> Result<(), EvaluateError> {
        // Drops work whose results were not collected.
        let mut plan = self.work[set].take().map_or_else(|| std::mem::take(&mut self.spare[set]), |work| work.plan);
        let observed = matches!(leaves, Leaves::Blocks { .. });
        let kernel = Kernel { leaves: leaves.groups().is_some(), ..self.kernel(sums, observed) };
        self.twice(|gpu| gpu.opened().map(drop))?;
        let context = self.context.as_ref().expect("opened above");
        let most = most_candidates(&kernel, &leaves, &context.device.limits);
        plan.make(jobs, observers, &self.cases, &self.courses, &context.tables, &kernel, most)?;
        let work = Work { kernel, plan, leaves };
        self.twice(|gpu| gpu.opened()?.start(set, &work))?;
        self.work[set] = Some(work);
        Ok(())
    }

    /// Waits for a set and puts its results into `results`; without work in flight they are empty.
    fn finish(&mut self, set: usize) -> Result<Work, EvaluateError> {
        let mut results = std::mem::take(&mut self.results);
        self.twice(|gpu| match (&mut gpu.context, &gpu.work[set]) {
            (Some(context), Some(work)) => context.finish(set, work, &mut results),
            (_, None) => Ok(()),
            (None, _) => Err(Fault::new("opening the device", "it was lost")),
        })?;
        self.results = results;
        Ok(self.work[set].take().unwrap_or_else(|| Work {
            kernel: self.kernel(Sums::All, false),
            plan: Plan::default(),
            leaves: Leaves::Nothing,
        }))
    }
}

impl Evaluator for Gpu {
    fn cases(&self) -> &[Case] {
        &self.cases
    }

    fn gof(&self) -> &GoodnessOfFit {
        &self.gof
    }

    fn name(&self) -> &'static str {
        "gpu"
    }

    fn precision(&self) -> &'static str {
        self.precision.into_str()
    }

    fn adapter(&self) -> Option<String> {
        Some(self.adapter.clone())
    }

    fn timings(&self) -> Timings {
        self.context.as_ref().map_or(self.spent, |context| self.spent + context.timings())
    }

    fn overlaps(&self) -> bool {
        true
    }

    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        self.start(set as usize, jobs, Sums::Score(self.gof.accumulation()), &[], Leaves::Nothing)
    }

    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        let set = set as usize;
        let candidates = self.work[set].as_ref().map_or(0, |work| work.plan.positions.len());
        if scores.len() != candidates {
            return Err(EvaluateError::Room { candidates, scores: scores.len() });
        }
        let work = self.finish(set)?;
        let mut position = work.plan.positions.iter();
        for (word, position) in self.results.words.iter().zip(&mut position) {
            scores[*position] = score_of(*word);
        }
        self.spare[set] = work.plan;
        Ok(())
    }

    fn slopes(&mut self, job: &Job<'_>, differences: &[Differences]) -> Result<Option<Vec<Slopes>>, EvaluateError> {
        self.slopes_in_parts(job, differences).map(Some)
    }

    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError> {
        let raw = self.raw(jobs)?;
        Ok(Raw::outcomes(&raw, jobs, &self.cases, &self.courses))
    }
}
