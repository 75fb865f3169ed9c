//! The GPU backend: the kernels of [`crate::kernels`] as WGSL on a wgpu device.
//!
//! A key's planes go up once, from the engine's private copy, the field before colour: the device
//! derives what the scatter reads while the CPU still copies colour. Nothing waits for an upload;
//! it runs on the device while the engine goes on. A frame is one submission: its dispatches, and a
//! copy to memory that the CPU reads. Buffers are kept from key to key; they grow and never shrink.
//!
//! Every picture is the same, byte for byte, as the CPU's. Whatever a driver does ends in a
//! [`GpuError`], never in a panic; what then happens is up to [`super::fallback`].

pub mod adapters;
mod device;
mod error;
mod picture;
mod planes;
pub mod test_adapters;
mod transfer;

use std::sync::Arc;

use zerocopy::IntoBytes;

pub use adapters::{GpuAdapter, adapters};
pub use device::Gpu;
pub use error::GpuError;
pub use picture::GpuPicture;

use super::shader::{Extent, LIST_HEADER, STRIP, Shader, Slot};
use super::{FrameInput, Passes};
use crate::color::{ColorFormat, ColorPlane};
use crate::field::FieldMap;
use crate::fill::far_side::FAR_SIDE;
use crate::finish::compensate::COMPENSATE;
use crate::finish::pyramid::PYRAMID;
use crate::finish::shares::Split;
use crate::key::KeyFrame;
use crate::light::relight::RELIGHT;
use crate::method::Method;
use crate::params::{FrameParams, light_words, map_words, weight_words};
use crate::phase::Phase;
use crate::trajectory::effective::EFFECTIVE;
use crate::warp::blend::BLEND;
use crate::warp::gather::GATHER;
use crate::warp::grid::{GRID, LANES, MeshWords, TRIANGLE_BYTES};
use crate::warp::linear::{LINEAR, OLDER_COLORS, PREVIOUS, kept_keys, linked_keys};
use crate::warp::resolve::{CLASSIFY, RESOLVE};
use crate::warp::scatter::{SCATTER, SOURCE};
use crate::warp::voxel::{Between, VOXEL, VOXEL_OLDER, VoxelWords};
use device::Compiled;
use picture::Spares;
use planes::Planes;
use transfer::{Download, Upload};

/// The shaders that run once per key.
fn key_shaders(method: Method) -> &'static [&'static Shader] {
    match method {
        Method::Linear | Method::Voxel => &[&SOURCE],
        _ => &[],
    }
}

/// The shaders that run before those of a frame where the field of its key accelerates.
fn accelerating_shaders(method: Method) -> &'static [&'static Shader] {
    match method {
        Method::Linear => &[&EFFECTIVE],
        _ => &[],
    }
}

/// The shaders that make a frame, in order. `method` is one that has a warp of its own.
fn frame_shaders(method: Method) -> &'static [&'static Shader] {
    match method {
        Method::Blend => &[&BLEND],
        Method::Gather => &[&GATHER],
        Method::Grid => &[&GRID],
        Method::Linear => &[&SCATTER, &RESOLVE, &FAR_SIDE, &CLASSIFY, &LINEAR],
        Method::Voxel => &[&SCATTER, &RESOLVE, &FAR_SIDE, &CLASSIFY, &VOXEL, &VOXEL_OLDER],
        _ => &[],
    }
}

/// The shaders that make a frame between two keys where nothing is known of how surfaces came to
/// the newer one.
fn unmoved_shaders(method: Method) -> &'static [&'static Shader] {
    match method {
        Method::Voxel => &[&BLEND],
        _ => &[],
    }
}

/// The shaders that fill its holes from the keys before, one for each where that may be.
fn filling_shaders(method: Method) -> &'static [&'static Shader] {
    match method {
        Method::Linear => &[&PREVIOUS[0], &PREVIOUS[1], &PREVIOUS[2], &PREVIOUS[3]],
        _ => &[],
    }
}

/// The shaders that finish a frame, in order.
const FINISH_SHADERS: [&Shader; 2] = [&PYRAMID, &COMPENSATE];

/// A shader of a method, ready to run.
type Step = (&'static Shader, Arc<Compiled>);

/// What one stream keeps on a device.
#[derive(Debug)]
pub(crate) struct GpuBackend {
    gpu: Arc<Gpu>,
    method: Method,
    key_steps: Vec<Step>,
    accelerating_steps: Vec<Step>,
    frame_steps: Vec<Step>,
    unmoved_steps: Vec<Step>,
    filling_steps: Vec<Step>,
    /// Empty in a stream whose light is not continued.
    relight_steps: Vec<Step>,
    /// Empty in a stream that is not finished.
    finish_steps: Vec<Step>,
    /// Whether the light of levels is on the device.
    has_lights: bool,
    planes: Planes,
    field_upload: [Upload; 4],
    color_upload: Upload,
    download: Download,
    /// For pictures that stay on the device.
    spares: Spares,
    /// The field map as the shaders read it.
    tables: Vec<u32>,
    /// How far tiles are blurred, as the shader reads it.
    weights: Vec<u32>,
    /// Of how many keys [`Slot::Was`] holds fields, and which of them is the newest one's.
    held_fields: u32,
    newest_field: u32,
    mesh: MeshWords,
    voxel: VoxelWords,
}

impl GpuBackend {
    /// For a stream of `format` and `method` that may need `passes`. Compiles what it needs.
    ///
    /// # Errors
    /// If the device is gone or takes a shader not.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        format: ColorFormat,
        method: Method,
        passes: Passes,
    ) -> Result<Self, GpuError> {
        let steps = |shaders: &[&'static Shader]| -> Result<Vec<Step>, GpuError> {
            shaders.iter().map(|shader| Ok((*shader, gpu.shader(shader, format)?))).collect()
        };
        Ok(Self {
            gpu: Arc::clone(gpu),
            method,
            key_steps: steps(key_shaders(method))?,
            accelerating_steps: steps(accelerating_shaders(method))?,
            frame_steps: steps(frame_shaders(method))?,
            unmoved_steps: steps(unmoved_shaders(method))?,
            filling_steps: steps(filling_shaders(method))?,
            relight_steps: if passes.relights { steps(&[&RELIGHT])? } else { Vec::new() },
            finish_steps: if passes.finishes { steps(&FINISH_SHADERS)? } else { Vec::new() },
            has_lights: false,
            planes: Planes::default(),
            field_upload: Default::default(),
            color_upload: Upload::default(),
            download: Download::default(),
            spares: Spares::default(),
            tables: Vec::new(),
            weights: Vec::new(),
            held_fields: 1,
            newest_field: 0,
            mesh: MeshWords::default(),
            voxel: VoxelWords::default(),
        })
    }

    /// Sends `key` up. Returns before it is there.
    ///
    /// # Errors
    /// If the device is gone, or the key too large for it.
    pub(crate) fn take_key(&mut self, key: &KeyFrame, map: &FieldMap) -> Result<(), GpuError> {
        let moves = !key.velocity.data().is_empty();
        if self.method == Method::Hold || (!self.method.interpolates() && !moves) {
            return Ok(());
        }
        match self.method {
            Method::Grid => self.mesh.take_key(key),
            Method::Voxel => self.voxel.take_key(key),
            _ => (),
        }
        let gpu = Arc::clone(&self.gpu);
        gpu.guard(|| {
            let kept = match self.method {
                Method::Blend | Method::Voxel => 1,
                Method::Linear => kept_keys(key.velocity.data().len()),
                _ => 0,
            };
            for slot in &OLDER_COLORS[..kept] {
                self.planes.swap(Slot::Color, *slot);
            }
            if self.method != Method::Blend && moves {
                self.send_field(key, map)?;
            }
            if self.method == Method::Linear && !key.depth.data().is_empty() {
                self.keep_field(key)?;
            }
            self.send_color(key)
        })
    }

    /// Sends the field of `key`, which has motion, up again. Returns before it is there.
    ///
    /// # Errors
    /// If the device is gone.
    pub(crate) fn take_field(&mut self, key: &KeyFrame, map: &FieldMap) -> Result<(), GpuError> {
        let gpu = Arc::clone(&self.gpu);
        gpu.guard(|| self.send_field(key, map))
    }

    fn send_field(&mut self, key: &KeyFrame, map: &FieldMap) -> Result<(), GpuError> {
        let gpu = Arc::clone(&self.gpu);
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        // A binding cannot be empty: without depth it is one word that no shader reads.
        let depth = key.depth.data().as_bytes();
        let depth = if depth.is_empty() { &[0; 4] } else { depth };
        let parts: &[(Slot, &[u8])] = if self.method == Method::Grid {
            let MeshWords { vertices, cuts, .. } = &self.mesh;
            &[(Slot::Vertices, vertices.as_bytes()), (Slot::Cuts, cuts.as_bytes())]
        } else {
            map_words(map, &mut self.tables);
            let velocity = match self.method {
                Method::Voxel => &self.voxel.turned,
                _ => &key.velocity,
            };
            &[
                (Slot::Velocity, velocity.data().as_bytes()),
                (Slot::Depth, depth),
                (Slot::Tables, self.tables.as_bytes()),
                (Slot::Acceleration, key.acceleration.data().as_bytes()),
            ]
        };
        let parts = parts.iter().filter(|(_, bytes)| !bytes.is_empty());
        let sent = parts.clone().count();
        for (upload, (slot, bytes)) in self.field_upload.iter_mut().zip(parts) {
            let target = self.planes.sized(&gpu, *slot, bytes.len() as u64)?;
            upload.write(&gpu, &mut commands, bytes, target)?;
        }
        let params = self.params(key, map, Phase::ZERO);
        self.make_room(&params)?;
        self.planes.write_params(&gpu, &params)?;
        dispatch(&gpu, &mut commands, &self.key_steps, &self.planes, &params)?;
        let submission = gpu.queue.submit([commands.finish()]);
        for upload in self.field_upload.iter_mut().take(sent) {
            upload.submitted(&submission);
        }
        Ok(())
    }

    /// Keeps the field of `key`, which has gone up, for holes after it and after later keys.
    fn keep_field(&mut self, key: &KeyFrame) -> Result<(), GpuError> {
        let gpu = Arc::clone(&self.gpu);
        let cells = key.depth.data().len();
        let bytes = 4 * cells as u64;
        self.held_fields = kept_keys(cells) as u32 + 1;
        self.newest_field = (self.newest_field + 1) % self.held_fields;
        let place = u64::from(self.newest_field) * 2 * bytes;
        self.planes.sized(&gpu, Slot::Was, u64::from(self.held_fields) * 2 * bytes)?;
        let was = self.planes.held(Slot::Was)?;
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        commands.copy_buffer_to_buffer(self.planes.held(Slot::Depth)?, 0, was, place, bytes);
        if key.came.data().is_empty() {
            let velocity = self.planes.held(Slot::Velocity)?;
            commands.copy_buffer_to_buffer(velocity, 0, was, place + bytes, bytes);
        } else {
            gpu.queue.write_buffer(was, place + bytes, key.came.data().as_bytes());
        }
        gpu.queue.submit([commands.finish()]);
        Ok(())
    }

    /// Sends what frames between two keys read of `older` beside its colour, unless it is there.
    fn send_older(&mut self, older: &KeyFrame) -> Result<(), GpuError> {
        if self.voxel.take_older(older) {
            let gpu = Arc::clone(&self.gpu);
            let bytes = self.voxel.past.as_bytes();
            let past = self.planes.sized(&gpu, Slot::Was, bytes.len() as u64)?;
            gpu.queue.write_buffer(past, 0, bytes);
        }
        Ok(())
    }

    fn send_color(&mut self, key: &KeyFrame) -> Result<(), GpuError> {
        let gpu = Arc::clone(&self.gpu);
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let bytes = key.color.as_bytes();
        let target = self.planes.sized(&gpu, Slot::Color, bytes.len() as u64)?;
        self.color_upload.write(&gpu, &mut commands, bytes, target)?;
        let submission = gpu.queue.submit([commands.finish()]);
        self.color_upload.submitted(&submission);
        Ok(())
    }

    fn params(&self, key: &KeyFrame, map: &FieldMap, phase: Phase) -> FrameParams {
        FrameParams {
            mesh_cells: self.mesh.cells,
            held_fields: self.held_fields,
            newest_field: self.newest_field,
            ..FrameParams::new(key, map, phase)
        }
    }

    /// Gives every plane that only shaders write its size.
    fn make_room(&mut self, params: &FrameParams) -> Result<(), GpuError> {
        let area = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
        let limit = self.gpu.device.limits().max_storage_buffer_binding_size;
        for (shader, _) in self.key_steps.iter().chain(&self.frame_steps) {
            for slot in shader.bindings.iter().map(|binding| binding.slot()) {
                let size = match slot {
                    Slot::Holes | Slot::Broken => 4 * (LIST_HEADER + area(params.cells)),
                    // A picture as large as a binding has more pixels than that lists, but holes
                    // have a surface to continue, which is no hole.
                    Slot::Hidden => (4 * (LIST_HEADER + area(params.size))).min(limit),
                    Slot::Held
                    | Slot::Near
                    | Slot::Top
                    | Slot::Splat
                    | Slot::Carried
                    | Slot::Origin
                    | Slot::StackedRows
                    | Slot::BesideColumns => 4 * area(params.cells),
                    Slot::Triangles => 2 * TRIANGLE_BYTES * area(params.mesh_cells),
                    Slot::Nearest | Slot::Shown => 4 * area(params.size),
                    Slot::Color
                    | Slot::Older
                    | Slot::SecondOlder
                    | Slot::ThirdOlder
                    | Slot::FourthOlder
                    | Slot::Velocity
                    | Slot::Acceleration
                    | Slot::Depth
                    | Slot::Tables
                    | Slot::Vertices
                    | Slot::Cuts
                    | Slot::HalfLevel
                    | Slot::QuarterLevel
                    | Slot::SmoothLevel
                    | Slot::Lights
                    | Slot::Weights
                    | Slot::Gains
                    | Slot::Was
                    | Slot::Out => continue,
                };
                self.planes.sized(&self.gpu, slot, size)?;
            }
        }
        Ok(())
    }

    /// Gives the levels their sizes, and sends up the weights of tiles, and once the light of
    /// levels.
    fn prepare_finish(
        &mut self,
        split: &Split<'_>,
        params: &FrameParams,
        bytes_per_pixel: u64,
    ) -> Result<(), GpuError> {
        let gpu = Arc::clone(&self.gpu);
        let half = params.valid_size.map(|side| side.div_ceil(2));
        let quarter = half.map(|side| side.div_ceil(2));
        let sizes =
            [(Slot::HalfLevel, half), (Slot::QuarterLevel, quarter), (Slot::SmoothLevel, half)];
        for (slot, [width, height]) in sizes {
            let size = u64::from(width) * u64::from(height) * bytes_per_pixel;
            self.planes.sized(&gpu, slot, size)?;
        }
        if !self.has_lights {
            let words = light_words(split);
            let bytes = words.as_bytes();
            let lights = self.planes.sized(&gpu, Slot::Lights, bytes.len() as u64)?;
            gpu.queue.write_buffer(lights, 0, bytes);
            self.has_lights = true;
        }
        weight_words(split, &mut self.weights);
        let bytes = self.weights.as_bytes();
        let weights = self.planes.sized(&gpu, Slot::Weights, bytes.len() as u64)?;
        gpu.queue.write_buffer(weights, 0, bytes);
        Ok(())
    }

    /// Makes a picture into `out`, which has the size and format of the keys; they have been taken.
    /// One that it `keeps` stays on the device instead, done, and `out` is unspecified.
    ///
    /// # Errors
    /// If the device is gone, refuses, or does not answer; `out` is then unspecified.
    pub(crate) fn make(
        &mut self,
        frame: &FrameInput<'_>,
        out: &mut ColorPlane,
        keeps: bool,
    ) -> Result<Option<GpuPicture>, GpuError> {
        let gpu = Arc::clone(&self.gpu);
        gpu.guard(|| {
            let mut params = self.params(frame.newest, frame.map, frame.phase);
            let older = frame.past.first().filter(|_| self.method == Method::Voxel);
            let mut is_unmoved = false;
            if let Some(older) = older {
                let between = Between { older, newer: frame.newest, phase: frame.phase };
                match self.voxel.params(params, &between) {
                    Some(between) => params = between,
                    None => is_unmoved = true,
                }
                self.send_older(older)?;
            }
            let bytes_per_pixel = u64::from(out.format().bytes_per_pixel());
            let columns_and_rows = [out.width(), out.height()];
            let bytes = out.as_mut_bytes();
            let size = bytes.len() as u64;
            if let Some(spare) = self.spares.take() {
                self.planes.put_missing(Slot::Out, spare);
            }
            self.planes.sized(&gpu, Slot::Out, size)?;
            if let Some(gains) = frame.gains {
                let bytes = gains.data().as_bytes();
                let gains = self.planes.sized(&gpu, Slot::Gains, bytes.len() as u64)?;
                gpu.queue.write_buffer(gains, 0, bytes);
            }
            if let Some(split) = &frame.finish {
                params = params.finished(split);
                self.prepare_finish(split, &params, bytes_per_pixel)?;
            }
            self.planes.write_params(&gpu, &params)?;
            let mut commands = gpu.device.create_command_encoder(&Default::default());
            if !frame.newest.acceleration.data().is_empty() {
                dispatch(&gpu, &mut commands, &self.accelerating_steps, &self.planes, &params)?;
            }
            let steps = if is_unmoved { &self.unmoved_steps } else { &self.frame_steps };
            dispatch(&gpu, &mut commands, steps, &self.planes, &params)?;
            let linked = linked_keys(frame.newest, frame.past).min(self.filling_steps.len());
            dispatch(&gpu, &mut commands, &self.filling_steps[..linked], &self.planes, &params)?;
            if frame.gains.is_some() {
                dispatch(&gpu, &mut commands, &self.relight_steps, &self.planes, &params)?;
            }
            if frame.finish.is_some() {
                dispatch(&gpu, &mut commands, &self.finish_steps, &self.planes, &params)?;
            }
            if keeps {
                let submission = gpu.queue.submit([commands.finish()]);
                gpu.wait(submission)?;
                let made = self.planes.take(Slot::Out)?;
                return Ok(Some(GpuPicture::new(&gpu, made, columns_and_rows, &self.spares)));
            }
            let made = self.planes.sized(&gpu, Slot::Out, size)?;
            self.download.copy(&gpu, &mut commands, made, size);
            let submission = gpu.queue.submit([commands.finish()]);
            self.download.read(&gpu, submission, bytes)?;
            Ok(None)
        })
    }
}

/// Adds `steps` to `commands`, one dispatch per entry point.
fn dispatch(
    gpu: &Gpu,
    commands: &mut wgpu::CommandEncoder,
    steps: &[Step],
    planes: &Planes,
    params: &FrameParams,
) -> Result<(), GpuError> {
    for (shader, compiled) in steps {
        for slot in shader.cleared {
            commands.clear_buffer(planes.held(*slot)?, 0, slot.cleared_bytes());
        }
        let group = planes.bind(gpu, shader, &compiled.layout)?;
        let mut pass = commands.begin_compute_pass(&Default::default());
        pass.set_bind_group(0, &group, &[]);
        for (entry, pipeline) in shader.entries.iter().zip(&compiled.pipelines) {
            let [columns, rows] = match entry.extent {
                Extent::Pixels => params.size,
                Extent::Cells => params.cells,
                Extent::CellColumns => [params.cells[0], 1],
                Extent::CellRows => [params.cells[1], 1],
                Extent::One => [1, 1],
                Extent::HalfPixels => params.valid_size.map(|side| side.div_ceil(2)),
                Extent::QuarterPixels => params.valid_size.map(|side| side.div_ceil(4)),
                Extent::CellStrips => [params.cells[0], params.cells[1].div_ceil(STRIP)],
                Extent::Listed(slot) => {
                    pass.set_pipeline(pipeline);
                    pass.dispatch_workgroups_indirect(planes.held(slot)?, 0);
                    continue;
                }
                Extent::Triangles => [2 * params.mesh_cells[0], params.mesh_cells[1]],
                Extent::TriangleLanes => [2 * LANES * params.mesh_cells[0], params.mesh_cells[1]],
            };
            pass.set_pipeline(pipeline);
            let [width, height] = entry.workgroup;
            pass.dispatch_workgroups(columns.div_ceil(width), rows.div_ceil(height), 1);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
