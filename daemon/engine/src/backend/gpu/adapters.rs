//! The GPU adapters of this machine.

use crate::backend::choice::{AdapterFacts, AdapterKind};
use crate::backend::shader::MOST_BINDINGS;

/// Invocations of the largest workgroup.
const INVOCATIONS: u32 = 256;

/// One GPU adapter, not opened.
#[derive(Debug)]
pub struct GpuAdapter {
    /// What is known of it.
    pub facts: AdapterFacts,
    pub(super) adapter: wgpu::Adapter,
    pub(super) instance: wgpu::Instance,
}

/// Every GPU adapter that a driver offers, in the order of the drivers. None without a driver.
#[must_use]
pub fn adapters() -> Vec<GpuAdapter> {
    let descriptor = wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        // Neither validation nor debug layers: they are a driver developer's, and may be absent.
        flags: wgpu::InstanceFlags::empty(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    };
    let instance = wgpu::Instance::new(descriptor);
    let found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    found.into_iter().map(|adapter| GpuAdapter::new(&instance, adapter)).collect()
}

impl GpuAdapter {
    fn new(instance: &wgpu::Instance, adapter: wgpu::Adapter) -> Self {
        let info = adapter.get_info();
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
            wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
            wgpu::DeviceType::VirtualGpu => AdapterKind::Virtual,
            wgpu::DeviceType::Cpu => AdapterKind::Cpu,
            wgpu::DeviceType::Other => AdapterKind::Other,
        };
        let facts = AdapterFacts {
            name: info.name,
            kind,
            driver: info.driver,
            driver_info: info.driver_info,
            pci_bus_id: info.device_pci_bus_id,
            binding_limit: adapter.limits().max_storage_buffer_binding_size,
            unusable: unusable(&adapter),
        };
        Self { facts, adapter, instance: instance.clone() }
    }

    /// What a device is opened with: what the kernels need, and planes and windows as large as the
    /// adapter takes.
    pub(super) fn limits(&self) -> wgpu::Limits {
        let offered = self.adapter.limits();
        wgpu::Limits {
            max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
            max_buffer_size: offered.max_buffer_size,
            max_texture_dimension_2d: offered.max_texture_dimension_2d,
            ..needed()
        }
    }
}

/// The least that the kernels run with.
fn needed() -> wgpu::Limits {
    wgpu::Limits {
        max_storage_buffers_per_shader_stage: MOST_BINDINGS,
        max_compute_invocations_per_workgroup: INVOCATIONS,
        ..wgpu::Limits::downlevel_defaults()
    }
}

/// What the adapter lacks, if anything.
fn unusable(adapter: &wgpu::Adapter) -> Option<String> {
    let flags = adapter.get_downlevel_capabilities().flags;
    if !flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS) {
        return Some("no compute shaders".to_owned());
    }
    if !flags.contains(wgpu::DownlevelFlags::INDIRECT_EXECUTION) {
        return Some("no indirect dispatch".to_owned());
    }
    let mut lacks = Vec::new();
    needed().check_limits_with_fail_fn(&adapter.limits(), false, |limit, needed, found| {
        lacks.push(format!("{limit}: expected {needed}, found {found}"));
    });
    (!lacks.is_empty()).then(|| lacks.join("; "))
}
