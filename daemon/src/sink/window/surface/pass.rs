//! The pass that draws a picture of a stream on a surface.
//!
//! The picture is a buffer of the engine's texels, as they are; the shader places it, scales it to
//! the nearest pixel, and turns its texels into what the surface's stand for.

use foreframe_engine::backend::gpu::{Gpu, GpuError, GpuPicture};
use foreframe_engine::color::ColorFormat;
use foreframe_engine::format::{Primaries, Transfer};
use foreframe_engine::{ColorPlane, Rect, StreamFormat};

use super::policy::{Encoding, SurfaceFormat};
use crate::sink::srgb::{self, Matrix};
use crate::sink::window::placement::Placement;

const SHADER: &str = include_str!("surface.wgsl");
/// Words of the shader's parameters.
const PARAMS: usize = 20;

/// A picture to be drawn.
#[derive(Debug)]
pub(super) enum Picture<'a> {
    /// In memory.
    Here(&'a ColorPlane),
    /// On the device that draws it.
    Kept(&'a GpuPicture),
}

impl Picture<'_> {
    /// Columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        match self {
            Self::Here(frame) => [frame.width(), frame.height()],
            Self::Kept(picture) => picture.size(),
        }
    }
}

/// Draws the pictures of one stream on surfaces of one format.
#[derive(Debug)]
pub(super) struct Pass {
    stream: StreamFormat,
    encoding: Encoding,
    pipeline: wgpu::RenderPipeline,
    params: wgpu::Buffer,
    /// Where pictures from the CPU go, once there was one, and the pass that reads it.
    upload: Option<(wgpu::Buffer, wgpu::BindGroup)>,
}

impl Pass {
    /// # Errors
    /// If the device is gone or takes the shader not.
    pub(super) fn new(
        gpu: &Gpu,
        stream: &StreamFormat,
        surface: &SurfaceFormat,
    ) -> Result<Self, GpuError> {
        let constants = constants(stream, surface.encoding);
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..wgpu::PipelineCompilationOptions::default()
        };
        gpu.guard(|| {
            let device = gpu.device();
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("surface"),
                source: wgpu::ShaderSource::Wgsl(SHADER.into()),
            });
            let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("surface"),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vertex"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: None,
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fragment"),
                    compilation_options,
                    targets: &[Some(surface.texture.into())],
                }),
                multiview_mask: None,
                cache: None,
            });
            let params = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("surface"),
                size: (PARAMS * 4) as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let encoding = surface.encoding;
            Ok(Self { stream: *stream, encoding, pipeline, params, upload: None })
        })
    }

    /// Submits what draws `picture` on `target`, black around it. Returns before it is done.
    ///
    /// # Errors
    /// If the device is gone, or the picture too large for it.
    pub(super) fn draw(
        &mut self,
        gpu: &Gpu,
        picture: &Picture<'_>,
        placement: &Placement,
        target: &wgpu::Texture,
    ) -> Result<(), GpuError> {
        gpu.guard(|| {
            let words = params(picture.size(), placement, &self.stream, self.encoding);
            gpu.queue().write_buffer(&self.params, 0, &words);
            let group = match picture {
                Picture::Here(frame) => self.upload(gpu, frame.as_bytes()),
                Picture::Kept(picture) => self.bind(gpu, picture.buffer()),
            };
            let view = target.create_view(&wgpu::TextureViewDescriptor::default());
            let mut commands = gpu.device().create_command_encoder(&Default::default());
            let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("surface"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..3, 0..1);
            drop(pass);
            gpu.queue().submit([commands.finish()]);
            Ok(())
        })
    }

    /// Sends a picture up.
    fn upload(&mut self, gpu: &Gpu, bytes: &[u8]) -> wgpu::BindGroup {
        let size = bytes.len() as u64;
        let held = self.upload.take().filter(|(buffer, _)| buffer.size() == size);
        let (buffer, group) = held.unwrap_or_else(|| {
            let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("picture"),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let group = self.bind(gpu, &buffer);
            (buffer, group)
        });
        gpu.queue().write_buffer(&buffer, 0, bytes);
        self.upload = Some((buffer, group.clone()));
        group
    }

    fn bind(&self, gpu: &Gpu, picture: &wgpu::Buffer) -> wgpu::BindGroup {
        gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("surface"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: self.params.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: picture.as_entire_binding() },
            ],
        })
    }
}

/// What the shader has to know when it is compiled.
fn constants(stream: &StreamFormat, encoding: Encoding) -> [(&'static str, f64); 4] {
    let format = match stream.color {
        ColorFormat::Rgba8 => 0.0,
        ColorFormat::Rgb10a2 => 1.0,
        ColorFormat::Rgba16f => 2.0,
    };
    let transfer = match stream.transfer {
        Transfer::Srgb => 0.0,
        Transfer::Linear => 1.0,
        Transfer::Pq => 2.0,
    };
    let as_they_are = matches!(
        (encoding, stream.transfer, stream.primaries),
        (Encoding::SrgbCodes, Transfer::Srgb, Primaries::Bt709)
            | (Encoding::Light, Transfer::Linear, Primaries::Bt709)
            | (Encoding::PqCodes, Transfer::Pq, Primaries::Bt2020)
    );
    let to_encoding = match encoding {
        Encoding::SrgbCodes => 0.0,
        Encoding::ClippedLight => 1.0,
        Encoding::Light => 2.0,
        Encoding::PqCodes => 3.0,
    };
    let as_they_are = f64::from(u8::from(as_they_are));
    [
        ("FORMAT", format),
        ("TRANSFER", transfer),
        ("ENCODING", to_encoding),
        ("AS_THEY_ARE", as_they_are),
    ]
}

/// The parameters as the shader reads them.
fn params(
    size: [u32; 2],
    placement: &Placement,
    stream: &StreamFormat,
    encoding: Encoding,
) -> [u8; PARAMS * 4] {
    let Rect { x, y, width, height } = placement.picture;
    let primaries = match encoding {
        Encoding::PqCodes => srgb::bt2020_from(stream.primaries),
        _ => srgb::bt709_from(stream.primaries),
    };
    let words = [x, y, width, height, size[0], size[1], srgb::white(stream).to_bits(), 0];
    let words = words.into_iter().chain(rows(primaries));
    let mut bytes = [0; PARAMS * 4];
    for (place, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(words) {
        *place = word.to_le_bytes();
    }
    bytes
}

/// Four words a row.
fn rows(matrix: Matrix) -> impl Iterator<Item = u32> {
    matrix.into_iter().flat_map(|[red, green, blue]| [red, green, blue, 0.0].map(f32::to_bits))
}

#[cfg(test)]
mod tests;
