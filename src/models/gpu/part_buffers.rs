//! Buffers and bind group of the candidates of one part.

use super::device::{Device, Fault};
use super::kernel::{WINDOW_LENGTH, Windows};
use super::plan::{Part, Work};
use super::results::Results;
use super::tables::Tables;
use wgpu::BufferUsages as Usages;

/// Positions in [`BUFFERS`].
const CANDIDATES: usize = 0;
const RESULTS: usize = 2;
const BLOCKS: usize = 3;
const RESULTS_BACK: usize = 4;
const BLOCKS_BACK: usize = 5;

/// Name, usage.
const BUFFERS: [(&str, Usages); 6] = [
    ("candidates", Usages::STORAGE.union(Usages::COPY_DST)),
    ("states", Usages::STORAGE),
    ("results", Usages::STORAGE.union(Usages::COPY_SRC)),
    ("blocks", Usages::STORAGE.union(Usages::COPY_SRC).union(Usages::COPY_DST)),
    ("results read back", Usages::MAP_READ.union(Usages::COPY_DST)),
    ("blocks read back", Usages::MAP_READ.union(Usages::COPY_DST)),
];

#[derive(Debug)]
pub(super) struct PartBuffers {
    buffers: [wgpu::Buffer; 6],
    chunk: wgpu::Buffer,
    window: wgpu::Buffer,
    /// Bind group and the tables in it.
    bound: Option<(usize, wgpu::BindGroup)>,
}

/// Bytes of each buffer.
fn sizes(part: &Part, work: &Work) -> [u64; 6] {
    let bytes = |words: u32| 4 * u64::from(words) * u64::from(part.count);
    let (results, blocks) = (bytes(work.kernel.result_words()), bytes(work.leaves.words()));
    // Errors of a stretch stay on the device.
    let blocks_back = if work.leaves.groups().is_some() { 0 } else { blocks };
    [bytes(work.kernel.candidate_words()), bytes(work.kernel.state_words()), results, blocks, results, blocks_back]
}

impl PartBuffers {
    /// The bindings of shaders/kernel.wgsl.
    pub(super) fn layout(device: &Device) -> wgpu::BindGroupLayout {
        let entry = |binding: u32| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: match binding {
                    0..=4 => wgpu::BufferBindingType::Storage { read_only: true },
                    5..=7 => wgpu::BufferBindingType::Storage { read_only: false },
                    _ => wgpu::BufferBindingType::Uniform,
                },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let entries: Vec<_> = (0..10).map(entry).collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("kernel"), entries: &entries };
        device.raw.create_bind_group_layout(&descriptor)
    }

    pub(super) fn new(device: &Device) -> PartBuffers {
        let uniform = Usages::UNIFORM | Usages::COPY_DST;
        PartBuffers {
            // Bindings must not be empty.
            buffers: BUFFERS.map(|(label, usage)| device.buffer(label, 256, usage)),
            chunk: device.buffer("chunk", 48, uniform),
            window: device.buffer(
                "window",
                16 * if device.windows == Windows::Nothing { 1 } else { u64::from(WINDOW_LENGTH) },
                uniform,
            ),
            bound: None,
        }
    }

    /// Buffers that are large enough, and a bind group with them.
    pub(super) fn prepare(
        &mut self,
        device: &Device,
        layout: &wgpu::BindGroupLayout,
        (group, tables): (usize, &Tables),
        part: &Part,
        work: &Work,
    ) {
        for (k, needed) in sizes(part, work).into_iter().enumerate() {
            if self.buffers[k].size() < needed {
                // By doubling, so that slowly growing populations do not allocate every time.
                let most = device.limits.binding.min(device.limits.buffer).max(needed);
                let (label, usage) = BUFFERS[k];
                self.buffers[k] = device.buffer(label, needed.next_power_of_two().min(most), usage);
                self.bound = None;
            }
        }
        if self.bound.as_ref().is_none_or(|(bound, _)| *bound != group) {
            let all = tables.buffers.iter().chain(&self.buffers[..=BLOCKS]).chain([&self.chunk, &self.window]);
            self.bound = Some((group, device.bind_group(layout, all)));
        }
    }

    pub(super) fn upload(&self, device: &Device, words: &[u32]) {
        device.queue.write_buffer(&self.buffers[CANDIDATES], 0, bytemuck::cast_slice(words));
    }

    /// `Chunk` of the kernel: from_sample, to_sample, candidates, stride, zero, block, two zeros, and the start of the window.
    pub(super) fn write_chunk(
        &self,
        device: &Device,
        [from, to, candidates, stride]: [u32; 4],
        block: u32,
        window: u32,
    ) {
        let words = [from, to, candidates, stride, 0, block, 0, 0, window, 0, 0, 0];
        device.queue.write_buffer(&self.chunk, 0, bytemuck::cast_slice(&words));
    }

    pub(super) fn dispatch(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::ComputePipeline,
        groups: [u32; 2],
    ) {
        let (_, bind_group) = self.bound.as_ref().expect("prepared before");
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, bind_group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }

    /// Copies the part of `samples` that a chunk reads: first entry and number.
    pub(super) fn copy_window(&self, encoder: &mut wgpu::CommandEncoder, tables: &Tables, [begin, length]: [u32; 2]) {
        let bytes = |entries: u32| 16 * u64::from(entries);
        encoder.copy_buffer_to_buffer(tables.samples(), bytes(begin), &self.window, 0, bytes(length));
    }

    /// Zeroes what runs leave: they leave nothing before they start, or after they have failed.
    pub(super) fn clear(&self, encoder: &mut wgpu::CommandEncoder, part: &Part, work: &Work) {
        if work.leaves.words() > 0 {
            encoder.clear_buffer(&self.buffers[BLOCKS], 0, Some(sizes(part, work)[BLOCKS]));
        }
    }

    pub(super) fn read_back(&self, encoder: &mut wgpu::CommandEncoder, part: &Part, work: &Work) {
        let sizes = sizes(part, work);
        for (from, to) in [(RESULTS, RESULTS_BACK), (BLOCKS, BLOCKS_BACK)] {
            if sizes[to] > 0 {
                encoder.copy_buffer_to_buffer(&self.buffers[from], 0, &self.buffers[to], 0, sizes[to]);
            }
        }
    }

    /// Appends the results of a finished submission. It waits for nothing else, because another buffer set may be in flight.
    pub(super) fn read(
        &self,
        device: &Device,
        part: &Part,
        work: &Work,
        done: Option<&wgpu::SubmissionIndex>,
        results: &mut Results,
    ) -> Result<(), Fault> {
        let sizes = sizes(part, work);
        for (k, to) in [(RESULTS_BACK, &mut results.words), (BLOCKS_BACK, &mut results.blocks)] {
            read_words(device, &self.buffers[k], sizes[k], done, to)?;
        }
        Ok(())
    }

    /// What the runs leave.
    pub(super) fn left(&self) -> &wgpu::Buffer {
        &self.buffers[BLOCKS]
    }
}

/// Appends the first bytes of a buffer that a finished submission has copied to.
pub(super) fn read_words(
    device: &Device,
    buffer: &wgpu::Buffer,
    bytes: u64,
    done: Option<&wgpu::SubmissionIndex>,
    to: &mut Vec<u32>,
) -> Result<(), Fault> {
    if bytes == 0 {
        return Ok(());
    }
    let slice = buffer.slice(0..bytes);
    // A later check reveals whether it worked.
    slice.map_async(wgpu::MapMode::Read, |_| ());
    device.wait(done.cloned())?;
    let view = slice.get_mapped_range().map_err(|e| Fault::new("reading the results", e))?;
    to.extend(view.chunks_exact(4).map(|word| u32::from_ne_bytes(word.try_into().expect("four bytes"))));
    drop(view);
    buffer.unmap();
    Ok(())
}
