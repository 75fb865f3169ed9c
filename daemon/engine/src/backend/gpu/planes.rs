//! The buffers of one stream, one plane each.

use zerocopy::IntoBytes;

use super::GpuError;
use super::device::Gpu;
use crate::backend::shader::{Shader, Slot};
use crate::params::FrameParams;

/// Buffers by [`Slot`], and the one of the parameters.
#[derive(Debug)]
pub(super) struct Planes {
    planes: [Option<wgpu::Buffer>; Slot::COUNT],
    params: Option<wgpu::Buffer>,
}

impl Default for Planes {
    fn default() -> Self {
        Self { planes: [const { None }; Slot::COUNT], params: None }
    }
}

impl Planes {
    /// The buffer of `slot`, of at least `size` bytes. What it held is lost where it grows.
    pub(super) fn sized(
        &mut self,
        gpu: &Gpu,
        slot: Slot,
        size: u64,
    ) -> Result<&wgpu::Buffer, GpuError> {
        let limits = gpu.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if size > limit {
            return Err(GpuError::TooLarge { needed: size, limit });
        }
        let held = &mut self.planes[slot as usize];
        if held.as_ref().is_some_and(|buffer| buffer.size() < size) {
            *held = None;
        }
        Ok(held.get_or_insert_with(|| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("plane"),
                size,
                usage: wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::COPY_DST
                    | wgpu::BufferUsages::COPY_SRC
                    | wgpu::BufferUsages::INDIRECT,
                mapped_at_creation: false,
            })
        }))
    }

    /// The buffer of `slot`, which is there.
    pub(super) fn held(&self, slot: Slot) -> Result<&wgpu::Buffer, GpuError> {
        let held = self.planes[slot as usize].as_ref();
        held.ok_or_else(|| GpuError::Refused { why: format!("{slot:?} has no buffer yet") })
    }

    /// Takes the buffer of `slot` away; the next one will be another.
    pub(super) fn take(&mut self, slot: Slot) -> Result<wgpu::Buffer, GpuError> {
        let held = self.planes[slot as usize].take();
        held.ok_or_else(|| GpuError::Refused { why: format!("{slot:?} has no buffer yet") })
    }

    /// Gives `slot` this buffer, unless it has one.
    pub(super) fn put_missing(&mut self, slot: Slot, buffer: wgpu::Buffer) {
        self.planes[slot as usize].get_or_insert(buffer);
    }

    /// Lets two planes change places.
    pub(super) fn swap(&mut self, a: Slot, b: Slot) {
        self.planes.swap(a as usize, b as usize);
    }

    /// Sets the parameters of what is submitted next.
    pub(super) fn write_params(&mut self, gpu: &Gpu, params: &FrameParams) -> Result<(), GpuError> {
        let buffer = self.params.get_or_insert_with(|| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("parameters"),
                size: size_of::<FrameParams>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        gpu.queue.write_buffer(buffer, 0, params.as_bytes());
        Ok(())
    }

    /// What `shader` binds.
    pub(super) fn bind(
        &self,
        gpu: &Gpu,
        shader: &Shader,
        layout: &wgpu::BindGroupLayout,
    ) -> Result<wgpu::BindGroup, GpuError> {
        let planes = shader.bindings.iter().map(|binding| &self.planes[binding.slot() as usize]);
        let buffers: Option<Vec<_>> =
            std::iter::once(&self.params).chain(planes).map(Option::as_ref).collect();
        let buffers = buffers.ok_or_else(|| GpuError::Refused {
            why: format!("{} ran before the key was there", shader.file),
        })?;
        let entries: Vec<_> = buffers
            .into_iter()
            .zip(0..)
            .map(|(buffer, binding)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        Ok(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(shader.file),
            layout,
            entries: &entries,
        }))
    }
}
