//! The available adapters, and the selection of one.

use crate::evaluator::{AdapterChoice, EvaluateError};
use crate::text::bounded::address_space;
use std::fmt;
use std::sync::OnceLock;

/// True if `LEADLAG_NO_GPU` forbids a GPU.
pub fn is_switched_off() -> bool {
    std::env::var_os("LEADLAG_NO_GPU").is_some()
}

/// An adapter that is present.
#[derive(Debug, Clone)]
pub struct Adapter {
    /// Position in the list of all, for `--gpu`.
    pub index: usize,
    pub(super) inner: wgpu::Adapter,
    /// Description by the driver.
    pub info: wgpu::AdapterInfo,
}

/// Address space \[bytes\] in which drivers can be loaded. Software Vulkan compiles with LLVM, has a thread and a heap per core, and ends the
/// program with a signal without enough of it: on two cores with 0.4 GB, but not with 0.5 GB (Mesa 22.3).
fn needed_address_space() -> u64 {
    const MOST_CORES: u64 = 16;
    let cores = std::thread::available_parallelism().map_or(1, |cores| (cores.get() as u64).min(MOST_CORES));
    (1 << 30) + cores * (128 << 20)
}

/// The limit of the address space, if it is too small for a driver to be loaded.
fn small_address_space() -> Option<u64> {
    address_space().filter(|limit| *limit < needed_address_space())
}

impl Adapter {
    /// All adapters, in the order of the drivers; none if no driver can be loaded.
    pub fn all() -> Vec<Adapter> {
        if small_address_space().is_some() {
            return Vec::new();
        }
        // Drivers are loaded once per process; an instance outlives any lost device.
        static INSTANCE: OnceLock<wgpu::Instance> = OnceLock::new();
        let backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
        let instance = INSTANCE.get_or_init(|| {
            let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
            descriptor.backends = backends;
            descriptor.flags = wgpu::InstanceFlags::empty();
            wgpu::Instance::new(descriptor)
        });
        let found = pollster::block_on(instance.enumerate_adapters(backends));
        let adapter = |(index, inner): (usize, wgpu::Adapter)| Adapter { index, info: inner.get_info(), inner };
        found.into_iter().enumerate().map(adapter).collect()
    }

    /// The requested one. The error names the adapters present; it is [`EvaluateError::AddressSpace`] if no driver can be loaded.
    pub fn choose(choice: &AdapterChoice) -> Result<Adapter, EvaluateError> {
        if let Some(limit) = small_address_space() {
            return Err(EvaluateError::AddressSpace { limit, needed: needed_address_space() });
        }
        let all = Adapter::all();
        let present: Vec<String> = all.iter().map(ToString::to_string).collect();
        let found = match choice {
            // The first of the best kind.
            AdapterChoice::Best => all.into_iter().min_by_key(Adapter::rank),
            AdapterChoice::Named(wanted) => {
                let position = all
                    .iter()
                    .position(|a| wanted.parse() == Ok(a.index))
                    .or_else(|| all.iter().position(|a| !wanted.is_empty() && a.pci().eq_ignore_ascii_case(wanted)))
                    .or_else(|| all.iter().position(|a| a.is_called(wanted)));
                position.and_then(|i| all.into_iter().nth(i))
            }
        };
        found.ok_or_else(|| EvaluateError::Adapter {
            wanted: match choice {
                AdapterChoice::Best => None,
                AdapterChoice::Named(wanted) => Some(wanted.clone()),
            },
            present,
        })
    }

    fn rank(&self) -> u32 {
        match self.info.device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        }
    }

    fn is_called(&self, wanted: &str) -> bool {
        !wanted.is_empty() && self.info.name.to_lowercase().contains(&wanted.to_lowercase())
    }

    /// PCI address such as `0000:01:00.0`; empty if the driver gives none.
    pub fn pci(&self) -> &str {
        &self.info.device_pci_bus_id
    }

    /// False for one that runs on the CPU.
    pub fn is_hardware(&self) -> bool {
        self.info.device_type != wgpu::DeviceType::Cpu
    }

    /// True for one with separate memory.
    pub fn is_discrete(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::DiscreteGpu
    }

    /// Name and version of the driver.
    pub fn driver(&self) -> String {
        format!("{} {}", self.info.driver, self.info.driver_info).trim().to_owned()
    }

    /// `discrete`, `integrated`, `virtual`, `other`, or `software`, which runs on the CPU.
    pub fn kind(&self) -> &'static str {
        match self.info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete",
            wgpu::DeviceType::IntegratedGpu => "integrated",
            wgpu::DeviceType::VirtualGpu => "virtual",
            wgpu::DeviceType::Other => "other",
            wgpu::DeviceType::Cpu => "software",
        }
    }

    /// The optional features that may matter here, by wgpu's names.
    pub fn features(&self) -> Vec<&'static str> {
        let all = self.inner.features();
        let known = [
            (wgpu::Features::SHADER_F64, "SHADER_F64"),
            (wgpu::Features::SHADER_INT64, "SHADER_INT64"),
            (wgpu::Features::SHADER_F16, "SHADER_F16"),
            (wgpu::Features::SUBGROUP, "SUBGROUP"),
            (wgpu::Features::TIMESTAMP_QUERY, "TIMESTAMP_QUERY"),
            (wgpu::Features::PIPELINE_CACHE, "PIPELINE_CACHE"),
        ];
        known.into_iter().filter(|(feature, _)| all.contains(*feature)).map(|(_, name)| name).collect()
    }

    /// The limits that may matter here, by wgpu's names.
    pub fn limits(&self) -> [(&'static str, u64); 5] {
        let all = self.inner.limits();
        [
            ("max_storage_buffer_binding_size", all.max_storage_buffer_binding_size),
            ("max_buffer_size", all.max_buffer_size),
            ("max_compute_workgroups_per_dimension", all.max_compute_workgroups_per_dimension.into()),
            ("max_compute_invocations_per_workgroup", all.max_compute_invocations_per_workgroup.into()),
            ("max_storage_buffers_per_shader_stage", all.max_storage_buffers_per_shader_stage.into()),
        ]
    }

    /// Name, backend and driver, as results record it.
    pub fn name(&self) -> String {
        format!("{} ({}, {})", self.info.name, self.info.backend, self.driver())
    }
}

impl fmt::Display for Adapter {
    /// One line: index, name, kind, PCI address.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}  {}", self.index, self.name())?;
        if !self.pci().is_empty() {
            write!(f, " at {}", self.pci())?;
        }
        Ok(())
    }
}
