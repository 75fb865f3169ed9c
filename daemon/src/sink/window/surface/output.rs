//! One surface of one adapter, and what it takes to present on it.

use std::sync::{Arc, PoisonError};

use foreframe_engine::backend::gpu::{Gpu, GpuError};
use foreframe_engine::{MonoSpan, MonoTime, StreamFormat};
use tracing::{debug, info};
use wgpu::{CompositeAlphaMode, CurrentSurfaceTexture, PresentMode, SurfaceTexture};

use super::pass::{Pass, Picture};
use super::patience::Patience;
use super::policy::{SurfaceFormat, Waits, present_mode, surface_format};
use super::{Canvas, SurfaceError};
use crate::clock;
use crate::sink::window::placement::Placement;
use crate::sink::window::shared::Shared;
use crate::sink::window::wayland::Gate;

/// Frames that a surface holds beside the one on display. One, so that none waits behind another.
const LATENCY: u32 = 1;
/// Tries to give a surface another size for one picture: what the engine submits in the middle of
/// one spoils it.
const TRIES: u32 = 5;
/// Time that a surface may refuse its size, picture after picture, before the CPU draws.
const REFUSES_FOR: MonoSpan = MonoSpan::from_ms(5000);
/// Time without word of the compositor before it is asked for once more.
const SILENT_FOR: MonoSpan = MonoSpan::from_ms(1000);

/// A surface, ready to be drawn on.
pub(super) struct Output {
    gpu: Arc<Gpu>,
    surface: wgpu::Surface<'static>,
    format: SurfaceFormat,
    mode: PresentMode,
    waits: Waits,
    alpha: CompositeAlphaMode,
    pass: Pass,
    /// Columns and rows that it has.
    size: Option<[u32; 2]>,
    refuses: Patience,
    gate: Gate,
    is_silent: Patience,
    shared: Arc<Shared>,
    /// Dropped after what is drawn on it with.
    canvas: Canvas,
}

impl Output {
    /// # Errors
    /// If the adapter cannot present there, or not as it should.
    pub(super) fn new(
        gpu: Arc<Gpu>,
        canvas: Canvas,
        stream: &StreamFormat,
        shared: Arc<Shared>,
    ) -> Result<Self, SurfaceError> {
        let made = match &canvas {
            Canvas::Wayland(face) => {
                let target = face.lock().unwrap_or_else(PoisonError::into_inner).target();
                gpu.instance().create_surface(wgpu::SurfaceTarget::from(target))
            }
            Canvas::Other { window, .. } => {
                gpu.instance().create_surface(wgpu::SurfaceTarget::from(window.clone()))
            }
        };
        let surface = made.map_err(|error| SurfaceError::Refused(error.to_string()))?;
        let offered = surface.get_capabilities(gpu.adapter());
        if offered.format_capabilities.is_empty() || offered.present_modes.is_empty() {
            return Err(SurfaceError::CannotPresent(gpu.name().to_owned()));
        }
        debug!(?offered, "surface");
        let asks = matches!(canvas, Canvas::Wayland(_));
        let (mode, waits) = present_mode(&offered.present_modes, asks)
            .ok_or_else(|| SurfaceError::NoMode(format!("{:?}", offered.present_modes)))?;
        let format = surface_format(&offered.format_capabilities, stream)
            .ok_or_else(|| SurfaceError::NoFormat(format!("{:?}", offered.format_capabilities)))?;
        let is_offered = |alpha: &CompositeAlphaMode| offered.alpha_modes.contains(alpha);
        let alpha = Some(CompositeAlphaMode::Opaque).filter(is_offered);
        let pass = Pass::new(&gpu, stream, &format)?;
        Ok(Self {
            surface,
            format,
            mode,
            waits,
            alpha: alpha.unwrap_or(CompositeAlphaMode::Auto),
            pass,
            size: None,
            refuses: Patience::new(REFUSES_FOR),
            gate: Gate::open(),
            is_silent: Patience::new(SILENT_FOR),
            shared,
            canvas,
            gpu,
        })
    }

    /// Mode and format, for people.
    pub(super) fn name(&self) -> String {
        let SurfaceFormat { texture, color_space, .. } = self.format;
        let (name, mode) = (self.gpu.name(), self.mode);
        format!("a surface of {name}, {mode:?}, {texture:?} {color_space:?}")
    }

    /// Draws `picture` and hands it to the display; false if that does not want it now.
    ///
    /// # Errors
    /// If the surface or the device does not work any more.
    pub(super) fn show(
        &mut self,
        planned: MonoTime,
        picture: &Picture<'_>,
    ) -> Result<bool, SurfaceError> {
        if let Picture::Kept(picture) = picture
            && !Arc::ptr_eq(picture.gpu(), &self.gpu)
        {
            return Err(SurfaceError::OtherDevice);
        }
        let placement = self.place(picture.size());
        let is_new = self.size != Some(placement.buffer);
        if self.waits == Waits::AtTheGate && !is_new && !self.is_asked_for() {
            return Ok(false);
        }
        let Some(texture) = self.acquire(placement.buffer)? else { return Ok(false) };
        self.pass.draw(&self.gpu, picture, &placement, &texture.texture)?;
        let gate = (self.waits == Waits::AtTheGate).then_some(&self.gate);
        if let Canvas::Wayland(face) = &self.canvas {
            face.lock().unwrap_or_else(PoisonError::into_inner).before_commit(planned, gate);
        }
        self.gpu.guard(|| {
            self.gpu.queue().present(texture);
            Ok(())
        })?;
        match &self.canvas {
            Canvas::Wayland(face) => {
                Ok(face.lock().unwrap_or_else(PoisonError::into_inner).after_commit())
            }
            Canvas::Other { .. } => Ok(true),
        }
    }

    /// Whether the compositor wants a picture. Where it has been silent for long, the request for
    /// its word may have stayed here, because the driver committed nothing; so that is sent. The
    /// gate stays shut: where nobody sees the window, a driver would wait for ever behind it.
    fn is_asked_for(&mut self) -> bool {
        if self.gate.is_open() {
            self.is_silent.renew();
            return true;
        }
        if self.is_silent.is_over(clock::now())
            && let Canvas::Wayland(face) = &self.canvas
        {
            self.is_silent.renew();
            face.lock().unwrap_or_else(PoisonError::into_inner).commit_rest();
        }
        false
    }

    fn place(&self, picture: [u32; 2]) -> Placement {
        let most = self.gpu.device().limits().max_texture_dimension_2d;
        match &self.canvas {
            Canvas::Wayland(face) => {
                face.lock().unwrap_or_else(PoisonError::into_inner).place(picture, most)
            }
            Canvas::Other { .. } => Placement::limited(picture, self.shared.size(), most),
        }
    }

    /// A texture of this size to draw on; None if there is none at the moment.
    fn acquire(&mut self, size: [u32; 2]) -> Result<Option<SurfaceTexture>, SurfaceError> {
        // Once as it is, and once with new images.
        for _ in 0..2 {
            if self.size != Some(size) && !self.configure(size)? {
                return Ok(None);
            }
            let acquired = self.gpu.guard(|| match self.surface.get_current_texture() {
                CurrentSurfaceTexture::Validation => {
                    Err(GpuError::Refused { why: "no texture of the surface".to_owned() })
                }
                other => Ok(other),
            });
            match acquired? {
                CurrentSurfaceTexture::Success(texture)
                | CurrentSurfaceTexture::Suboptimal(texture) => return Ok(Some(texture)),
                CurrentSurfaceTexture::Outdated => self.size = None,
                CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => {
                    return Ok(None);
                }
                CurrentSurfaceTexture::Lost | CurrentSurfaceTexture::Validation => {
                    return Err(SurfaceError::Lost);
                }
            }
        }
        Ok(None)
    }

    /// False if the surface does not take this size now.
    fn configure(&mut self, size: [u32; 2]) -> Result<bool, SurfaceError> {
        self.size = None;
        let configuration = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format: self.format.texture,
            color_space: self.format.color_space,
            width: size[0],
            height: size[1],
            present_mode: self.mode,
            desired_maximum_frame_latency: LATENCY,
            alpha_mode: self.alpha,
            view_formats: Vec::new(),
        };
        let mut tried = 0;
        loop {
            tried += 1;
            let configured = self.gpu.guard(|| {
                self.surface.configure(self.gpu.device(), &configuration);
                Ok(())
            });
            match configured {
                Ok(()) => break,
                Err(GpuError::Refused { .. }) if tried < TRIES => {}
                Err(GpuError::Refused { why }) => {
                    if self.refuses.is_new() {
                        info!(why, tried, ?size, "the surface does not take its size");
                    }
                    return match self.refuses.is_over(clock::now()) {
                        true => Err(GpuError::Refused { why }.into()),
                        false => Ok(false),
                    };
                }
                Err(error) => return Err(error.into()),
            }
        }
        debug!(?size, "surface");
        self.refuses.renew();
        self.size = Some(size);
        // New images have no frame before them that a driver could wait for.
        self.gate.reopen();
        Ok(true)
    }
}
