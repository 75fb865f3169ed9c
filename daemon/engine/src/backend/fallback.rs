//! The one place where a stream falls from the GPU to the CPU.
//!
//! A stream that has been given a GPU runs on it until the device is lost, runs out of memory,
//! refuses, or cannot be read back. Then the CPU makes the very picture that failed, from the keys
//! that the engine holds, and all that follow. Pictures are the same either way; [`BackendStatus`]
//! says what happened. There is no way back: a driver that failed once is not tried again.

use std::sync::Arc;

use rayon::ThreadPool;

use super::cpu::CpuBackend;
use super::gpu::{Gpu, GpuBackend, GpuError, GpuPicture};
use super::{FrameInput, Passes};
use crate::color::{ColorFormat, ColorPlane};
use crate::field::FieldMap;
use crate::key::KeyFrame;
use crate::method::Method;

/// What makes the pictures of a stream.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct BackendStatus {
    /// `cpu`, or `gpu:` and the name of the adapter.
    pub name: String,
    /// Why it is no longer the GPU that was asked for.
    pub fell_back: Option<String>,
}

impl Default for BackendStatus {
    fn default() -> Self {
        Self { name: "cpu".to_owned(), fell_back: None }
    }
}

/// A picture that was made.
#[derive(Debug)]
pub(crate) struct Made {
    /// Whether its passes are done already.
    pub(crate) is_finished: bool,
    /// Where it is, if it stayed on a device.
    pub(crate) kept: Option<GpuPicture>,
}

/// The backend of one stream.
#[derive(Debug, Default)]
pub(crate) struct Backend {
    cpu: CpuBackend,
    gpu: Option<GpuBackend>,
    status: BackendStatus,
}

impl Backend {
    pub(crate) fn status(&self) -> &BackendStatus {
        &self.status
    }

    /// Forgets the GPU and the keys, and why the CPU took over, not.
    pub(crate) fn restart(&mut self) {
        let fell_back = self.status.fell_back.take();
        *self =
            Self { status: BackendStatus { fell_back, ..Default::default() }, ..Self::default() };
    }

    /// Runs on `gpu` from the next key on, in a stream that has had none and may need `passes`.
    pub(crate) fn use_gpu(
        &mut self,
        gpu: &Arc<Gpu>,
        format: ColorFormat,
        method: Method,
        passes: Passes,
    ) {
        match GpuBackend::new(gpu, format, method, passes) {
            Ok(backend) => {
                self.gpu = Some(backend);
                self.status.name = format!("gpu:{}", gpu.name());
            }
            Err(error) => self.fall(&error),
        }
    }

    /// Prepares for the frames that `method` makes after `key`.
    pub(crate) fn take_key(
        &mut self,
        pool: &ThreadPool,
        method: Method,
        key: &KeyFrame,
        map: &FieldMap,
    ) {
        if !self.did_gpu(|gpu| gpu.take_key(key, map)) {
            self.cpu.take_key(pool, method, key);
        }
    }

    /// Whether there is a GPU and `step` went well on it.
    fn did_gpu(&mut self, step: impl FnOnce(&mut GpuBackend) -> Result<(), GpuError>) -> bool {
        let Some(gpu) = &mut self.gpu else { return false };
        match step(gpu) {
            Ok(()) => true,
            Err(error) => {
                self.fall(&error);
                false
            }
        }
    }

    /// Takes the field of the key that was taken last again: its trajectories have changed.
    pub(crate) fn take_field(
        &mut self,
        pool: &ThreadPool,
        method: Method,
        key: &KeyFrame,
        map: &FieldMap,
    ) {
        if !self.did_gpu(|gpu| gpu.take_field(key, map)) {
            self.cpu.take_key(pool, method, key);
        }
    }

    /// Makes a picture after the key that was taken last into `out`, which has the size and format
    /// of the keys. One that a device `keeps` stays there, and `out` is unspecified.
    pub(crate) fn make(
        &mut self,
        pool: &ThreadPool,
        frame: &FrameInput<'_>,
        out: &mut ColorPlane,
        keeps: bool,
    ) -> Made {
        if let Some(gpu) = &mut self.gpu {
            match gpu.make(frame, out, keeps) {
                Ok(kept) => return Made { is_finished: true, kept },
                Err(error) => {
                    self.fall(&error);
                    self.cpu.take_key(pool, frame.method, frame.newest);
                }
            }
        }
        self.cpu.make(pool, frame, out);
        Made { is_finished: false, kept: None }
    }

    fn fall(&mut self, error: &GpuError) {
        self.gpu = None;
        self.status = BackendStatus { fell_back: Some(error.to_string()), ..Default::default() };
    }
}
