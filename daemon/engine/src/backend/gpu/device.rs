//! One open GPU device, shared by all streams that run on it: its shaders are compiled once.
//!
//! Nothing here panics on what a driver does. Errors of a call are caught in scopes around it; what
//! a driver reports later is kept, and found by the next call of [`Gpu::guard`].

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::GpuError;
use super::adapters::GpuAdapter;
use crate::backend::shader::{Binding, Shader};
use crate::color::ColorFormat;
use crate::params::format_code;

/// How long a device may take to answer. Far more than a slow software adapter needs for a large
/// picture; without it a hung device would hang its stream.
pub(super) const TIMEOUT: Duration = Duration::from_secs(20);
/// How long a device that has failed may take to say that it is lost.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// The text of a shader, and the code of the colour format that it is compiled for.
type ShaderKey = (&'static [&'static str], u32);

/// An open device.
#[derive(Debug)]
pub struct Gpu {
    name: String,
    instance: wgpu::Instance,
    adapter: wgpu::Adapter,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    /// The first thing that went wrong outside of any call.
    fault: Arc<Mutex<Option<GpuError>>>,
    shaders: Mutex<BTreeMap<ShaderKey, Arc<Compiled>>>,
}

/// A shader as the device runs it.
#[derive(Debug)]
pub(super) struct Compiled {
    pub(super) layout: wgpu::BindGroupLayout,
    /// One per entry point, in order.
    pub(super) pipelines: Vec<wgpu::ComputePipeline>,
}

impl Gpu {
    /// Opens `adapter`.
    ///
    /// # Errors
    /// If it lacks what the kernels need, or its driver opens no device.
    pub fn open(adapter: &GpuAdapter) -> Result<Arc<Self>, GpuError> {
        let name = adapter.facts.name.clone();
        if let Some(why) = &adapter.facts.unusable {
            return Err(GpuError::Unusable { adapter: name, why: why.clone() });
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("foreframe"),
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let opened = pollster::block_on(adapter.adapter.request_device(&descriptor));
        let (device, queue) = opened.map_err(|error| GpuError::NoDevice {
            adapter: name.clone(),
            why: error.to_string(),
        })?;
        let fault = Arc::new(Mutex::new(None));
        let note = |fault: &Mutex<Option<GpuError>>, error| {
            let mut first = fault.lock().unwrap_or_else(PoisonError::into_inner);
            first.get_or_insert(error);
        };
        let kept = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error| note(&kept, named(&error))));
        let kept = Arc::clone(&fault);
        device.set_device_lost_callback(move |reason, message| {
            let why = format!("{reason:?} {message}").trim_end().to_owned();
            note(&kept, GpuError::Lost { why });
        });
        Ok(Arc::new(Self {
            name,
            instance: adapter.instance.clone(),
            adapter: adapter.adapter.clone(),
            device,
            queue,
            fault,
            shaders: Mutex::default(),
        }))
    }

    /// Name of the adapter.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it has failed for good: nothing that is started on it now will work.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.fault().is_some()
    }

    /// What surfaces that this device is to draw on are made with.
    #[must_use]
    pub fn instance(&self) -> &wgpu::Instance {
        &self.instance
    }

    /// What says how this device can draw on a surface.
    #[must_use]
    pub fn adapter(&self) -> &wgpu::Adapter {
        &self.adapter
    }

    /// The device itself. Calls that can fail go through [`Gpu::guard`].
    #[must_use]
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// Its queue, which all streams share.
    #[must_use]
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    fn fault(&self) -> Option<GpuError> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Gives the device up, as if it had been lost. For tests of what happens then.
    pub fn lose(&self) {
        self.device.destroy();
    }

    /// Runs `calls` and reports what the device had to say about them, or before.
    ///
    /// # Errors
    /// If they fail, the device refused one of them, or it is lost.
    pub fn guard<T>(&self, calls: impl FnOnce() -> Result<T, GpuError>) -> Result<T, GpuError> {
        let filters = [
            wgpu::ErrorFilter::Internal,
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Validation,
        ];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        let result = calls();
        // Scopes end in the opposite order of their beginnings.
        let errors = scopes.into_iter().rev().map(|scope| pollster::block_on(scope.pop()));
        let error = errors.collect::<Vec<_>>().into_iter().flatten().next();
        if error.is_some() || result.is_err() {
            // If the device was lost, that is the reason; it is told once the queue is empty.
            let polled = self
                .device
                .poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(LAST_WORDS) });
            drop(polled);
        }
        if let Some(fault) = self.fault() {
            return Err(fault);
        }
        if let Some(error) = error {
            return Err(named(&error));
        }
        result
    }

    /// Waits until the device has done `submission`, and all before it.
    pub(super) fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        let until =
            wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(TIMEOUT) };
        match self.device.poll(until) {
            Ok(_) => Ok(()),
            Err(wgpu::PollError::Timeout) => Err(GpuError::TimedOut { seconds: TIMEOUT.as_secs() }),
            Err(error) => Err(GpuError::Refused { why: error.to_string() }),
        }
    }

    /// `shader` for pictures of `format`, compiled now if it has not been.
    pub(super) fn shader(
        &self,
        shader: &'static Shader,
        format: ColorFormat,
    ) -> Result<Arc<Compiled>, GpuError> {
        let key = (shader.parts, format_code(format));
        let mut shaders = self.shaders.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(compiled) = shaders.get(&key) {
            return Ok(Arc::clone(compiled));
        }
        let text = shader.parts.concat();
        let compiled = self.compile(shader, &text, format).map_err(|error| match error {
            GpuError::Refused { why } => GpuError::Shader { shader: shader.file, why },
            other => other,
        })?;
        let compiled = Arc::new(compiled);
        shaders.insert(key, Arc::clone(&compiled));
        Ok(compiled)
    }

    pub(super) fn compile(
        &self,
        shader: &Shader,
        text: &str,
        format: ColorFormat,
    ) -> Result<Compiled, GpuError> {
        self.guard(|| {
            let device = &self.device;
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(shader.file),
                source: wgpu::ShaderSource::Wgsl(text.into()),
            });
            let layout = bind_group_layout(device, shader);
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(shader.file),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let uses_format = text.contains("override FORMAT");
            let constants = [("FORMAT", f64::from(format_code(format)))];
            let options = wgpu::PipelineCompilationOptions {
                constants: if uses_format { &constants } else { &[] },
                ..wgpu::PipelineCompilationOptions::default()
            };
            let pipelines = shader.entries.iter().map(|entry| {
                device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(entry.name),
                    layout: Some(&pipeline_layout),
                    module: &module,
                    entry_point: Some(entry.name),
                    compilation_options: options.clone(),
                    cache: None,
                })
            });
            Ok(Compiled { pipelines: pipelines.collect(), layout })
        })
    }
}

/// Slot 0 has the parameters, the others what the shader declares.
fn bind_group_layout(device: &wgpu::Device, shader: &Shader) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let storage = shader.bindings.iter().map(|binding| wgpu::BufferBindingType::Storage {
        read_only: matches!(binding, Binding::Read(_)),
    });
    let entries: Vec<_> = std::iter::once(wgpu::BufferBindingType::Uniform)
        .chain(storage)
        .zip(0..)
        .map(|(ty, binding)| entry(binding, ty))
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(shader.file),
        entries: &entries,
    })
}

fn named(error: &wgpu::Error) -> GpuError {
    // On one line, as errors here are.
    let why = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    match error {
        wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory { why },
        wgpu::Error::Validation { .. } | wgpu::Error::Internal { .. } => GpuError::Refused { why },
    }
}
