//! Memory that both the CPU and the device reach, kept from key to key and frame to frame.
//!
//! [`Upload`] is filled by the CPU and copied on the device; it is mapped again as soon as that is
//! done, so that the next key finds it ready. [`Download`] goes the other way.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use super::GpuError;
use super::device::{Gpu, TIMEOUT};

/// How far a mapping is.
///
/// Whichever thread polls the device runs the callbacks of all. So where several streams share a
/// device, the word may come a moment after the device is known to be done, and is waited for.
#[derive(Clone, Debug, Default)]
struct Mapping(Arc<(Mutex<Reached>, Condvar)>);

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum Reached {
    #[default]
    Pending,
    Ready,
    Failed,
}

impl Mapping {
    /// Asks for `buffer` to be mapped once the device is done with it.
    fn ask(&mut self, buffer: &wgpu::Buffer, mode: wgpu::MapMode) {
        // A state of its own: the word of an earlier mapping may still be dropped.
        self.0 = Arc::default();
        let word = Word(self.clone());
        buffer.map_async(mode, .., move |result| {
            word.0.reach(if result.is_ok() { Reached::Ready } else { Reached::Failed });
        });
    }

    fn reach(&self, reached: Reached) {
        *self.state() = reached;
        self.0.1.notify_all();
    }

    fn state(&self) -> MutexGuard<'_, Reached> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_ready(&self) -> bool {
        *self.state() == Reached::Ready
    }

    /// Whether it is mapped, once that is known: the device is done.
    fn is_ready_at_last(&self) -> bool {
        let is_pending = |reached: &mut Reached| *reached == Reached::Pending;
        let waited = self.0.1.wait_timeout_while(self.state(), TIMEOUT, is_pending);
        *waited.unwrap_or_else(PoisonError::into_inner).0 == Reached::Ready
    }
}

/// Owed by the device for a mapping that was asked for.
struct Word(Mapping);

impl Drop for Word {
    /// wgpu maps what is ready and then drops the callbacks unheard where it refuses a surface its
    /// size because somebody submits meanwhile. Whether it is mapped shows when it is read.
    fn drop(&mut self) {
        if *self.0.state() == Reached::Pending {
            self.0.reach(Reached::Ready);
        }
    }
}

/// Bytes on their way to the device.
#[derive(Debug, Default)]
pub(super) struct Upload {
    staging: Option<wgpu::Buffer>,
    mapping: Mapping,
    /// What has to be done before the buffer is mapped.
    last: Option<wgpu::SubmissionIndex>,
}

impl Upload {
    /// Copies `bytes`, a multiple of 4 of them, into the staging buffer, and onwards to the start
    /// of `target` as part of `commands`. [`Upload::submitted`] has to follow.
    pub(super) fn write(
        &mut self,
        gpu: &Gpu,
        commands: &mut wgpu::CommandEncoder,
        bytes: &[u8],
        target: &wgpu::Buffer,
    ) -> Result<(), GpuError> {
        let size = bytes.len() as u64;
        let staging = match self.staging.take().filter(|staging| staging.size() >= size) {
            Some(staging) => {
                let is_ready = match self.last.take() {
                    Some(last) if !self.mapping.is_ready() => {
                        gpu.wait(last)?;
                        self.mapping.is_ready_at_last()
                    }
                    _ => self.mapping.is_ready(),
                };
                if !is_ready {
                    return Err(GpuError::Refused { why: "no memory for an upload".to_owned() });
                }
                staging
            }
            None => gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("upload"),
                size,
                usage: wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: true,
            }),
        };
        let why = |error: wgpu::MapRangeError| GpuError::Refused { why: error.to_string() };
        staging.get_mapped_range_mut(..size).map_err(why)?.copy_from_slice(bytes);
        staging.unmap();
        commands.copy_buffer_to_buffer(&staging, 0, target, 0, size);
        self.staging = Some(staging);
        Ok(())
    }

    /// The commands that [`Upload::write`] added to have been submitted.
    pub(super) fn submitted(&mut self, submission: &wgpu::SubmissionIndex) {
        if let Some(staging) = &self.staging {
            self.mapping.ask(staging, wgpu::MapMode::Write);
            self.last = Some(submission.clone());
        }
    }
}

/// Bytes on their way back.
#[derive(Debug, Default)]
pub(super) struct Download {
    staging: Option<wgpu::Buffer>,
    mapping: Mapping,
}

impl Download {
    /// Copies the first `size` bytes of `source`, a multiple of 4, as the last of `commands`.
    pub(super) fn copy(
        &mut self,
        gpu: &Gpu,
        commands: &mut wgpu::CommandEncoder,
        source: &wgpu::Buffer,
        size: u64,
    ) {
        let staging = self.staging.take().filter(|staging| staging.size() == size);
        let staging = staging.unwrap_or_else(|| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("download"),
                size,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        commands.copy_buffer_to_buffer(source, 0, &staging, 0, size);
        self.staging = Some(staging);
    }

    /// Waits for what `submission` copied, and copies it into `out`.
    pub(super) fn read(
        &mut self,
        gpu: &Gpu,
        submission: wgpu::SubmissionIndex,
        out: &mut [u8],
    ) -> Result<(), GpuError> {
        let staging = self.staging.as_ref().ok_or(GpuError::ReadBack)?;
        self.mapping.ask(staging, wgpu::MapMode::Read);
        gpu.wait(submission)?;
        if !self.mapping.is_ready_at_last() {
            return Err(GpuError::ReadBack);
        }
        let bytes = staging.get_mapped_range(..).map_err(|_| GpuError::ReadBack)?;
        if bytes.len() != out.len() {
            return Err(GpuError::ReadBack);
        }
        out.copy_from_slice(&bytes);
        drop(bytes);
        staging.unmap();
        Ok(())
    }
}
