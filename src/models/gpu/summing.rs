//! Sums of products of differences, added up where the runs are: shaders/products.wgsl.

use super::device::{Device, Fault};
use super::kernel::{Replaced, summing_source};
use super::part_buffers::read_words;
use super::plan::{Groups, PAIR_WORDS};
use wgpu::BufferUsages as Usages;

/// Positions in [`BUFFERS`].
const GROUPS: usize = 0;
const SUMS: usize = 1;
const SUMS_BACK: usize = 2;

/// Name, usage.
const BUFFERS: [(&str, Usages); 3] = [
    ("groups", Usages::STORAGE.union(Usages::COPY_DST)),
    ("sums", Usages::STORAGE.union(Usages::COPY_SRC).union(Usages::COPY_DST)),
    ("sums read back", Usages::MAP_READ.union(Usages::COPY_DST)),
];

/// Pipeline and buffers of one device.
#[derive(Debug)]
pub(super) struct Summing {
    pipeline: wgpu::ComputePipeline,
    buffers: [wgpu::Buffer; 3],
    stretch: wgpu::Buffer,
    /// For the groups under way.
    bound: Option<wgpu::BindGroup>,
}

/// Bytes of each buffer.
fn sizes(groups: &Groups) -> [u64; 3] {
    let sums = 4 * u64::from(groups.words());
    [8 * groups.of.len() as u64, sums, sums]
}

impl Summing {
    /// Builds the pipeline under an error scope of the caller.
    pub(super) fn new(device: &Device, replaced: &Replaced) -> Summing {
        let source = wgpu::ShaderSource::Wgsl(summing_source(device.workgroup, replaced).text().to_owned().into());
        let module = device.raw.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("products"), source });
        let pipeline = device.raw.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("products"),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let stretch = device.buffer("stretch", 32, Usages::UNIFORM | Usages::COPY_DST);
        Summing {
            pipeline,
            buffers: BUFFERS.map(|(label, usage)| device.buffer(label, 256, usage)),
            stretch,
            bound: None,
        }
    }

    /// Buffers that are large enough, with the groups in them, bound to the errors of their runs.
    pub(super) fn prepare(&mut self, device: &Device, errors: &wgpu::Buffer, groups: &Groups) {
        for (k, needed) in sizes(groups).into_iter().enumerate() {
            if self.buffers[k].size() < needed {
                let (label, usage) = BUFFERS[k];
                self.buffers[k] = device.buffer(label, needed, usage);
            }
        }
        device.queue.write_buffer(&self.buffers[GROUPS], 0, bytemuck::cast_slice(&groups.of));
        let bindings = [errors, &self.buffers[GROUPS], &self.buffers[SUMS], &self.stretch];
        self.bound = Some(device.bind_group(&self.pipeline.get_bind_group_layout(0), bindings.into_iter()));
    }

    /// Adds the products of a stretch of this many samples; the first one starts from 0.
    pub(super) fn add(
        &self,
        device: &Device,
        encoder: &mut wgpu::CommandEncoder,
        groups: &Groups,
        [samples, candidates]: [u32; 2],
        is_first: bool,
    ) {
        let words = [samples, candidates, groups.of.len() as u32, groups.rows, 0, 0, 0, 0];
        device.queue.write_buffer(&self.stretch, 0, bytemuck::cast_slice(&words));
        if is_first {
            encoder.clear_buffer(&self.buffers[SUMS], 0, Some(sizes(groups)[SUMS]));
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bound, &[]);
        let workgroups = (groups.words() / PAIR_WORDS).div_ceil(device.workgroup);
        let x = workgroups.min(device.limits.workgroups);
        pass.dispatch_workgroups(x, workgroups.div_ceil(x), 1);
    }

    pub(super) fn read_back(&self, encoder: &mut wgpu::CommandEncoder, groups: &Groups) {
        encoder.copy_buffer_to_buffer(&self.buffers[SUMS], 0, &self.buffers[SUMS_BACK], 0, sizes(groups)[SUMS]);
    }

    /// Appends the sums of a finished submission.
    pub(super) fn read(
        &self,
        device: &Device,
        groups: &Groups,
        done: Option<&wgpu::SubmissionIndex>,
        to: &mut Vec<u32>,
    ) -> Result<(), Fault> {
        read_words(device, &self.buffers[SUMS_BACK], sizes(groups)[SUMS_BACK], done, to)
    }
}
