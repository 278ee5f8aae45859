//! Everything on a device that is lost with it: tables, pipelines, buffers, work in flight.

use super::adapter::Adapter;
use super::device::{Device, Fault, Limits};
use super::kernel::{Kernel, Replaced, Windows};
use super::part_buffers::PartBuffers;
use super::plan::Work;
use super::rate::Rate;
use super::results::Results;
use super::summing::Summing;
use super::tables::Tables;
use crate::evaluator::{Course, Timings};
use crate::score::GoodnessOfFit;
use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

/// Largest number of submissions of a buffer set in flight: one runs and one waits, so that the device is never idle.
const IN_FLIGHT: usize = 2;

#[derive(Debug)]
struct Submitted {
    index: wgpu::SubmissionIndex,
    at: Instant,
    candidate_steps: f64,
}

/// Progress of a buffer set.
#[derive(Debug, Default)]
struct Flight {
    part: usize,
    sample: u32,
    submitted: VecDeque<Submitted>,
    last_done: Option<Instant>,
    /// The last submission that is known to be done: after the last submission, the one that reads the last part back.
    done: Option<wgpu::SubmissionIndex>,
}

#[derive(Debug)]
pub(super) struct Context {
    pub(super) device: Device,
    pub(super) tables: Vec<Tables>,
    layout: wgpu::BindGroupLayout,
    pipeline_layout: wgpu::PipelineLayout,
    pipelines: HashMap<Kernel, wgpu::ComputePipeline>,
    /// Of products; made at its first use.
    summing: Option<Summing>,
    /// Buffers of each part, for each buffer set.
    buffers: [Vec<PartBuffers>; 3],
    flights: [Flight; 3],
    rate: Rate,
    /// Time spent on building and warming up pipelines.
    warm_up: Duration,
    /// Texts in the place of shader files.
    pub(super) replaced: Replaced,
    /// Host time for moving candidates to the device and results back.
    transfer: Duration,
}

impl Context {
    pub(super) fn open(
        adapter: &Adapter,
        limits: Limits,
        courses: &[Course],
        gof: &GoodnessOfFit,
    ) -> Result<Context, Fault> {
        let device = Device::open(adapter, limits)?;
        let tables = Tables::upload(&device, courses, gof)?;
        let layout = PartBuffers::layout(&device);
        let pipeline_layout = device.raw.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("kernel"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        device.check("opening the device")?;
        Ok(Context {
            device,
            tables,
            layout,
            pipeline_layout,
            pipelines: HashMap::new(),
            summing: None,
            buffers: Default::default(),
            flights: Default::default(),
            rate: Rate::UNKNOWN,
            warm_up: Duration::ZERO,
            replaced: Replaced::new(),
            transfer: Duration::ZERO,
        })
    }

    /// Time spent besides computing so far.
    pub(super) fn timings(&self) -> Timings {
        Timings { transfer_s: self.transfer.as_secs_f64(), first_dispatch_s: self.warm_up.as_secs_f64() }
    }

    /// Replaces the text of shader files; kernels are built again.
    pub(super) fn replace(&mut self, replaced: Replaced) {
        self.replaced = replaced;
        self.pipelines.clear();
        self.summing = None;
    }

    /// Uploads the candidates and submits the first chunks.
    pub(super) fn start(&mut self, set: usize, work: &Work) -> Result<(), Fault> {
        self.flights[set] = Flight::default();
        let began = Instant::now();
        let Context { device, tables, layout, buffers, .. } = self;
        device.making("uploading the candidates", || {
            for (k, part) in work.plan.parts.iter().enumerate() {
                if buffers[set].len() == k {
                    buffers[set].push(PartBuffers::new(device));
                }
                buffers[set][k].prepare(device, layout, (part.group, &tables[part.group]), part, work);
            }
            let mut rest = work.plan.words.as_slice();
            for (part, buffers) in work.plan.parts.iter().zip(&buffers[set]) {
                let (own, others) = rest.split_at((part.count * work.kernel.candidate_words()) as usize);
                rest = others;
                buffers.upload(device, own);
            }
        })?;
        self.transfer += began.elapsed();
        self.warm(set, work)?;
        self.prepare_groups(set, work)?;
        while self.flights[set].submitted.len() < IN_FLIGHT && self.submit_chunk(set, work) {}
        self.device.check("submitting work")
    }

    /// The sums of products of the groups under way.
    fn prepare_groups(&mut self, set: usize, work: &Work) -> Result<(), Fault> {
        let Some(groups) = work.leaves.groups() else { return Ok(()) };
        let began = Instant::now();
        let Context { device, summing, replaced, buffers, .. } = self;
        device.making("preparing the sums of products", || {
            let summing = summing.get_or_insert_with(|| Summing::new(device, replaced));
            summing.prepare(device, buffers[set][0].left(), groups);
        })?;
        self.warm_up += began.elapsed();
        Ok(())
    }

    /// The kernel in the form for this device, which may have replaced another one. On hardware it depends on the evaluator alone: two
    /// forms may differ in the last digits there, and results must not depend on the rest of a batch.
    fn kernel(&self, work: &Work) -> Kernel {
        let one_each = work.plan.parts.iter().all(|part| part.begin.is_some());
        let windows = match self.device.windows {
            Windows::All if one_each => Windows::All,
            Windows::Present => work.kernel.windows,
            _ => Windows::Nothing,
        };
        Kernel { workgroup: self.device.workgroup, ..work.kernel }.with_windows(windows)
    }

    /// Builds the pipeline unless it exists. Drivers compile at the first dispatch, so this includes an empty one.
    fn warm(&mut self, set: usize, work: &Work) -> Result<(), Fault> {
        const DOING: &str = "building the kernel";
        let Some(buffers) = self.buffers[set].first().filter(|_| !work.plan.parts.is_empty()) else { return Ok(()) };
        let kernel = self.kernel(work);
        if self.pipelines.contains_key(&kernel) {
            return Ok(());
        }
        let began = Instant::now();
        let device = &self.device.raw;
        // A pipeline that fails may take the device with it (gfx-rs/wgpu#10027).
        let pipeline = self.device.making(DOING, || {
            let source = wgpu::ShaderSource::Wgsl(kernel.source(&self.replaced).text().to_owned().into());
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("kernel"), source });
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("kernel"),
                layout: Some(&self.pipeline_layout),
                module: &module,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        })?;
        buffers.write_chunk(&self.device, [0, 0, 0, 1], work.leaves.block(), 0);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        buffers.dispatch(&mut encoder, &pipeline, [1, 1]);
        let submission = self.device.queue.submit([encoder.finish()]);
        self.device.wait(Some(submission)).map_err(|fault| Fault { doing: DOING, ..fault })?;
        self.pipelines.insert(kernel, pipeline);
        self.warm_up += began.elapsed();
        Ok(())
    }

    /// Submits the next chunk; false if there is none.
    fn submit_chunk(&mut self, set: usize, work: &Work) -> bool {
        let kernel = self.kernel(work);
        let flight = &mut self.flights[set];
        let Some(part) = work.plan.parts.get(flight.part) else { return false };
        let buffers = &self.buffers[set][flight.part];
        let chunk = self.device.limits.chunk.unwrap_or_else(|| self.rate.samples(part.count));
        let chunk = chunk.clamp(1, kernel.longest_chunk());
        let (from, to) = (flight.sample, (flight.sample + chunk).min(part.samples));
        let [begin, length] = kernel.window(part.begin.unwrap_or(0), [from, to]);
        buffers.write_chunk(&self.device, [from, to, part.count, part.count], work.leaves.block(), begin);
        let mut encoder = self.device.raw.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        if from == 0 {
            buffers.clear(&mut encoder, part, work);
        }
        if kernel.has_window() {
            buffers.copy_window(&mut encoder, &self.tables[part.group], [begin, length]);
        }
        let groups = part.count.div_ceil(kernel.workgroup);
        let x = groups.min(self.device.limits.workgroups);
        buffers.dispatch(&mut encoder, &self.pipelines[&kernel], [x, groups.div_ceil(x)]);
        let groups = work.leaves.groups().zip(self.summing.as_ref());
        if let Some((groups, summing)) = groups {
            summing.add(&self.device, &mut encoder, groups, [to - from, part.count], from == 0);
        }
        if to == part.samples {
            buffers.read_back(&mut encoder, part, work);
            if let Some((groups, summing)) = groups {
                summing.read_back(&mut encoder, groups);
            }
            (flight.part, flight.sample) = (flight.part + 1, 0);
        } else {
            flight.sample = to;
        }
        let index = self.device.queue.submit([encoder.finish()]);
        let candidate_steps = f64::from(to - from) * f64::from(part.count);
        flight.submitted.push_back(Submitted { index, at: Instant::now(), candidate_steps });
        true
    }

    /// Submits the remaining work, waits for all, and reads the results.
    pub(super) fn finish(&mut self, set: usize, work: &Work, results: &mut Results) -> Result<(), Fault> {
        while let Some(oldest) = self.flights[set].submitted.pop_front() {
            self.await_chunk(set, oldest)?;
            self.submit_chunk(set, work);
            self.device.check("submitting work")?;
        }
        results.words.clear();
        results.blocks.clear();
        let began = Instant::now();
        for (part, buffers) in work.plan.parts.iter().zip(&self.buffers[set]) {
            buffers.read(&self.device, part, work, self.flights[set].done.as_ref(), results)?;
        }
        if let Some((groups, summing)) = work.leaves.groups().zip(self.summing.as_ref()) {
            summing.read(&self.device, groups, self.flights[set].done.as_ref(), &mut results.blocks)?;
        }
        self.transfer += began.elapsed();
        self.device.check("reading the results")
    }

    /// Waits for one chunk and updates the estimate of the speed from its time.
    fn await_chunk(&mut self, set: usize, chunk: Submitted) -> Result<(), Fault> {
        let asked = Instant::now();
        self.device.wait(Some(chunk.index.clone()))?;
        let flight = &mut self.flights[set];
        flight.done = Some(chunk.index);
        let done = Instant::now();
        let began = flight.last_done.map_or(chunk.at, |last| last.max(chunk.at));
        let took = (done - began).as_secs_f64();
        // If there was nothing to wait for, the chunk was done some time ago.
        let waited = (done - asked).as_secs_f64() > 0.5 * took;
        self.rate.learn(chunk.candidate_steps, took, waited);
        flight.last_done = Some(done);
        Ok(())
    }
}
