//! A picture that stays on the device that made it, for whoever reads it there.
//!
//! Its buffer goes back to the backend that made it when the last reader has submitted what reads
//! it and drops it: what is submitted later on the same queue runs later.

use std::sync::{Arc, Mutex, PoisonError};

use super::device::Gpu;

/// Buffers that wait for the next picture.
const MOST_SPARES: usize = 3;

/// Buffers of pictures that nobody reads any more.
#[derive(Clone, Debug, Default)]
pub(super) struct Spares(Arc<Mutex<Vec<wgpu::Buffer>>>);

impl Spares {
    pub(super) fn take(&self) -> Option<wgpu::Buffer> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).pop()
    }

    fn put(&self, buffer: wgpu::Buffer) {
        let mut spares = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if spares.len() < MOST_SPARES {
            spares.push(buffer);
        }
    }
}

/// A picture on a device: the texels of the stream's format, row by row, from the start of a
/// storage buffer that may be longer.
#[derive(Debug)]
pub struct GpuPicture {
    gpu: Arc<Gpu>,
    buffer: wgpu::Buffer,
    size: [u32; 2],
    spares: Spares,
}

impl GpuPicture {
    pub(super) fn new(
        gpu: &Arc<Gpu>,
        buffer: wgpu::Buffer,
        size: [u32; 2],
        spares: &Spares,
    ) -> Self {
        Self { gpu: Arc::clone(gpu), buffer, size, spares: spares.clone() }
    }

    /// The device that it is on.
    #[must_use]
    pub fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    /// Where it lies.
    #[must_use]
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }
}

impl Drop for GpuPicture {
    fn drop(&mut self) {
        self.spares.put(self.buffer.clone());
    }
}
