//! Devices: opening, sharing and failures.

use super::adapter::Adapter;
use super::kernel::{LARGEST_WORKGROUP, WINDOW_LENGTH, Windows, workgroup};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Limits of the requests to a device, in addition to its own; tests lower them to reach the code for large work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of one binding of a storage buffer.
    pub binding: u64,
    /// Bytes of a buffer.
    pub buffer: u64,
    /// Workgroups in one dimension of a dispatch.
    pub workgroups: u32,
    /// Samples simulated per submission; without a value the measured speed decides.
    pub chunk: Option<u32>,
    /// Uses the kernels for hardware on a software device, too, to test them without hardware.
    #[doc(hidden)]
    pub as_hardware: bool,
}

impl Limits {
    /// The limits of the adapter.
    pub const NONE: Limits =
        Limits { binding: u64::MAX, buffer: u64::MAX, workgroups: u32::MAX, chunk: None, as_hardware: false };
}

/// The failure of a device, and the operation that caused it.
#[derive(Debug, Clone)]
pub(super) struct Fault {
    pub(super) doing: &'static str,
    pub(super) message: String,
    /// True if the device has too little memory for the operation.
    pub(super) is_memory: bool,
}

impl Fault {
    pub(super) fn new(doing: &'static str, message: impl ToString) -> Fault {
        Fault { doing, message: message.to_string(), is_memory: false }
    }
}

/// Longest wait for one submission; a chunk takes about 0.1 s, so a longer wait means that the driver hangs.
const PATIENCE: Duration = Duration::from_secs(60);

/// The first failure that a device reported.
type Trouble = Arc<Mutex<Option<String>>>;

/// A device as the driver has opened it.
#[derive(Debug, Clone)]
struct Opened {
    raw: wgpu::Device,
    queue: wgpu::Queue,
    trouble: Trouble,
}

/// The devices that evaluators share, by their adapter. Opening one takes time, and a driver has at most a few dozen open in one
/// process: NVIDIA's refuses the 63rd (H200, driver 580).
static SHARED: Mutex<Vec<(String, Opened)>> = Mutex::new(Vec::new());

/// The locked value, even if its last owner has panicked.
fn locked<T>(place: &Mutex<T>) -> MutexGuard<'_, T> {
    place.lock().unwrap_or_else(PoisonError::into_inner)
}

fn note(trouble: &Trouble, message: impl ToString) {
    locked(trouble).get_or_insert_with(|| message.to_string());
}

impl Opened {
    fn new(adapter: &Adapter, required_limits: wgpu::Limits) -> Result<Opened, Fault> {
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("leadlag"),
            required_limits,
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..Default::default()
        };
        let opened = pollster::block_on(adapter.inner.request_device(&descriptor));
        let (raw, queue) = opened.map_err(|e| Fault::new("opening the device", e))?;
        let trouble = Trouble::default();
        let place = Arc::clone(&trouble);
        raw.set_device_lost_callback(move |reason, message| {
            note(&place, format!("the device was lost ({reason:?}) {message}"));
        });
        let place = Arc::clone(&trouble);
        // Without a handler, wgpu panics.
        raw.on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(&place, error)));
        Ok(Opened { raw, queue, trouble })
    }

    /// The open device of this adapter, or a new one if none without a failure is open.
    fn shared(adapter: &Adapter, required_limits: wgpu::Limits) -> Result<Opened, Fault> {
        let name = adapter.to_string();
        let mut shared = locked(&SHARED);
        let lost: Vec<_> = shared.extract_if(.., |(_, opened)| locked(&opened.trouble).is_some()).collect();
        let found = shared.iter().find(|(of, _)| *of == name).map(|(_, opened)| opened.clone());
        let opened = match found {
            Some(opened) => Ok(opened),
            None => Opened::new(adapter, required_limits).inspect(|opened| shared.push((name, opened.clone()))),
        };
        drop(shared);
        // A driver may take long for this, so no caller waits for it.
        drop(lost);
        opened
    }
}

/// An open device, and the share of one evaluator.
#[derive(Debug)]
pub(super) struct Device {
    pub(super) raw: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) limits: Limits,
    pub(super) windows: Windows,
    /// Invocations of a workgroup.
    pub(super) workgroup: u32,
    trouble: Trouble,
    /// Buffers and bind groups made so far.
    made: AtomicU64,
}

impl Device {
    /// The device that evaluators share, unless a request exceeds its limits.
    pub(super) fn open(adapter: &Adapter, limits: Limits) -> Result<Device, Fault> {
        let open = if limits == Limits::NONE { Opened::shared } else { Opened::new };
        Device::opened_by(open, adapter, limits)
    }

    /// A separate device: its failures affect no other evaluator.
    pub(super) fn alone(adapter: &Adapter) -> Result<Device, Fault> {
        Device::opened_by(Opened::new, adapter, Limits::NONE)
    }

    fn opened_by(
        open: fn(&Adapter, wgpu::Limits) -> Result<Opened, Fault>,
        adapter: &Adapter,
        limits: Limits,
    ) -> Result<Device, Fault> {
        let can = adapter.inner.limits();
        let limits = Limits {
            binding: limits.binding.min(can.max_storage_buffer_binding_size) & !255,
            buffer: limits.buffer.min(can.max_buffer_size) & !255,
            workgroups: limits.workgroups.min(can.max_compute_workgroups_per_dimension),
            ..limits
        };
        let downlevel = wgpu::Limits::downlevel_defaults();
        let window = u64::from(WINDOW_LENGTH) * 16;
        let as_hardware = adapter.is_hardware() || limits.as_hardware;
        let windows = match as_hardware {
            _ if can.max_uniform_buffer_binding_size < window => Windows::Nothing,
            true => Windows::Present,
            false => Windows::All,
        };
        let uniform = downlevel.max_uniform_buffer_binding_size;
        let required_limits = wgpu::Limits {
            max_uniform_buffer_binding_size: if windows == Windows::Nothing { uniform } else { uniform.max(window) },
            max_storage_buffers_per_shader_stage: 8,
            max_storage_buffer_binding_size: limits.binding,
            max_buffer_size: limits.buffer,
            max_compute_workgroups_per_dimension: limits.workgroups,
            ..downlevel
        };
        let Opened { raw, queue, trouble } = open(adapter, required_limits)?;
        let workgroup = if limits.as_hardware { LARGEST_WORKGROUP } else { workgroup(adapter.info.subgroup_max_size) };
        Ok(Device { raw, queue, limits, windows, workgroup, trouble, made: AtomicU64::new(0) })
    }

    /// Fails if the device has reported a failure.
    pub(super) fn check(&self, doing: &'static str) -> Result<(), Fault> {
        match &*locked(&self.trouble) {
            Some(message) => Err(Fault::new(doing, message)),
            None => Ok(()),
        }
    }

    /// Waits until a submission, or all, is done.
    pub(super) fn wait(&self, submission: Option<wgpu::SubmissionIndex>) -> Result<(), Fault> {
        const DOING: &str = "waiting for the device";
        let poll = wgpu::PollType::Wait { submission_index: submission, timeout: Some(PATIENCE) };
        // A device that is lost during the wait makes wgpu panic instead of returning an error.
        let polled = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| self.raw.poll(poll)));
        match polled {
            Ok(Ok(_)) => {}
            // A device that does not answer must not be shared.
            Ok(Err(e)) => note(&self.trouble, e),
            Err(_) => note(&self.trouble, "the device was lost"),
        }
        self.check(DOING)
    }

    /// Withdraws this device from sharing; evaluators that have it keep it.
    pub(super) fn retire(&self) {
        let retired = locked(&SHARED).extract_if(.., |(_, opened)| opened.raw == self.raw).next();
        drop(retired);
    }

    /// Allocates memory of the device. A failure that leaves the device intact is returned to the caller, and does not affect others
    /// that share it.
    pub(super) fn making<T>(&self, doing: &'static str, make: impl FnOnce() -> T) -> Result<T, Fault> {
        let filters = [wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory];
        let scopes = filters.map(|filter| self.raw.push_error_scope(filter));
        let made = make();
        match scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop())).last() {
            Some(error) => {
                let is_memory = matches!(error, wgpu::Error::OutOfMemory { .. });
                Err(Fault { is_memory, ..Fault::new(doing, error) })
            }
            None => self.check(doing).map(|()| made),
        }
    }

    /// True if all submitted work is done.
    pub(super) fn is_idle(&self) -> bool {
        self.raw.poll(wgpu::PollType::Poll).is_ok_and(|status| status.is_queue_empty())
    }

    pub(super) fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.made.fetch_add(1, Ordering::Relaxed);
        self.raw.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
    }

    /// Binds each buffer whole, from binding 0 on.
    pub(super) fn bind_group<'a>(
        &self,
        layout: &wgpu::BindGroupLayout,
        buffers: impl Iterator<Item = &'a wgpu::Buffer>,
    ) -> wgpu::BindGroup {
        self.made.fetch_add(1, Ordering::Relaxed);
        let entry = |(binding, buffer): (u32, &'a wgpu::Buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        };
        let entries: Vec<_> = (0..).zip(buffers).map(entry).collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some("kernel"), layout, entries: &entries };
        self.raw.create_bind_group(&descriptor)
    }

    /// Number of buffers and bind groups that were made.
    pub(super) fn made(&self) -> u64 {
        self.made.load(Ordering::Relaxed)
    }

    /// True if a buffer of this size can be bound whole.
    pub(super) fn holds(&self, bytes: u64) -> bool {
        bytes <= self.limits.binding.min(self.limits.buffer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::AdapterChoice;

    #[test]
    fn asking_for_too_large_a_buffer_is_no_trouble_of_the_others() {
        if crate::gpu::is_switched_off() {
            println!("SKIPPED asking_for_too_large_a_buffer_is_no_trouble_of_the_others: LEADLAG_NO_GPU is set");
            return;
        }
        let adapter = Adapter::choose(&AdapterChoice::Best).expect("an adapter, or LEADLAG_NO_GPU=1");
        let device = Device::alone(&adapter).expect("it opens");
        let usage = wgpu::BufferUsages::STORAGE;
        let fault = device.making("asking for too much", || device.buffer("large", 1 << 60, usage));
        assert_eq!(fault.expect_err("there is not so much").doing, "asking for too much");
        device.making("asking for little", || device.buffer("small", 256, usage)).expect("there is so much");
        device.check("afterwards").expect("no other evaluator has heard of it");
    }
}
