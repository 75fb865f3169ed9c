//! What stands in for the GPU backend in a build without the feature `gpu`: there are no adapters,
//! so none is ever opened. What uses the backend in this crate reads the same either way; who
//! draws with an adapter, as windows do, needs the feature.

#[path = "gpu/error.rs"]
mod error;

use std::sync::Arc;

pub use error::GpuError;

use super::choice::AdapterFacts;
use super::{FrameInput, Passes};
use crate::color::{ColorFormat, ColorPlane};
use crate::field::FieldMap;
use crate::key::KeyFrame;
use crate::method::Method;

/// Where there could be a value, there is none.
#[derive(Clone, Copy, Debug)]
enum Never {}

/// A GPU adapter. None exists.
#[derive(Debug)]
pub struct GpuAdapter {
    /// What is known of it.
    pub facts: AdapterFacts,
    never: Never,
}

/// No adapters.
#[must_use]
pub fn adapters() -> Vec<GpuAdapter> {
    Vec::new()
}

/// An open device. None exists.
#[derive(Debug)]
pub struct Gpu(Never);

impl Gpu {
    /// Opens `adapter`.
    ///
    /// # Errors
    /// Never: there is no adapter to call it with.
    pub fn open(adapter: &GpuAdapter) -> Result<Arc<Self>, GpuError> {
        match adapter.never {}
    }

    /// Name of the adapter.
    #[must_use]
    pub fn name(&self) -> &str {
        match self.0 {}
    }

    /// Whether it has been lost.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        match self.0 {}
    }
}

/// A picture on a device. None exists.
#[derive(Debug)]
pub struct GpuPicture(Never);

/// A stream on a device. None exists.
#[derive(Debug)]
pub(crate) struct GpuBackend(Never);

impl GpuBackend {
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        _: ColorFormat,
        _: Method,
        _: Passes,
    ) -> Result<Self, GpuError> {
        match gpu.0 {}
    }

    pub(crate) fn take_key(&mut self, _: &KeyFrame, _: &FieldMap) -> Result<(), GpuError> {
        match self.0 {}
    }

    pub(crate) fn take_field(&mut self, _: &KeyFrame, _: &FieldMap) -> Result<(), GpuError> {
        match self.0 {}
    }

    pub(crate) fn make(
        &mut self,
        _: &FrameInput<'_>,
        _: &mut ColorPlane,
        _: bool,
    ) -> Result<Option<GpuPicture>, GpuError> {
        match self.0 {}
    }
}
