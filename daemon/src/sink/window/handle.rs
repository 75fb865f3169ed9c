//! One window, as its stream has it.

use std::sync::{Arc, Mutex, PoisonError};

use foreframe_engine::backend::gpu::{Gpu, GpuPicture};
use foreframe_engine::{ColorPlane, MonoSpan, MonoTime, StreamFormat};
use tracing::{info, warn};
use winit::window::WindowId;

use super::shared::Shared;
use super::software::Painter;
use super::surface::{Canvas, Coming, GpuSurface, Losses, SurfaceError};
use super::system::{Opened, WindowOpener};
use super::wayland::{Face, Guest, WaylandSurface};
use super::{Feedback, WindowConfig, WindowError, WindowEvent};
use crate::clock;

/// An open window. Closed when dropped.
#[derive(Debug)]
pub struct Window {
    surface: Surface,
    /// How pictures get into it, for people.
    way: String,
    /// The GPU that draws it, where one is to.
    gpu: Option<Arc<Gpu>>,
    losses: Losses,
    next: Next,
    canvas: Canvas,
    format: StreamFormat,
    shared: Arc<Shared>,
    refresh_interval: Option<MonoSpan>,
    id: WindowId,
    opener: WindowOpener,
}

/// How pictures get into it.
#[derive(Debug)]
enum Surface {
    Gpu(GpuSurface),
    Wayland(WaylandSurface),
    Software(Painter),
    /// Not at all.
    None,
}

/// What becomes of a surface that was lost.
#[derive(Debug)]
enum Next {
    /// None is made.
    Nothing,
    /// One is begun then.
    At(MonoTime),
    /// One is being made, while the CPU draws.
    Coming(Coming),
}

impl Surface {
    /// One that the CPU draws on.
    fn by_the_cpu(
        canvas: &Canvas,
        format: &StreamFormat,
        shared: &Arc<Shared>,
    ) -> Result<Self, WindowError> {
        match canvas {
            Canvas::Wayland(face) => {
                Ok(Self::Wayland(WaylandSurface::new(Arc::clone(face), format)))
            }
            Canvas::Other { window, display } => {
                let (window, display) = (window.clone(), display.clone());
                Painter::start(window, display, format, Arc::clone(shared)).map(Self::Software)
            }
        }
    }

    /// Its name, for people.
    fn name(&self) -> &str {
        match self {
            Self::Gpu(surface) => &surface.name,
            Self::Wayland(_) => "wl_shm",
            Self::Software(_) => "softbuffer",
            Self::None => "nothing",
        }
    }
}

impl Window {
    /// Opens a window, drawn by `gpu` where there is one that can. `wake` is called on other
    /// threads when there are events to take; it must not block.
    ///
    /// # Errors
    /// If the display is gone, does not answer in time, or lacks what a window needs.
    pub fn open(
        opener: &WindowOpener,
        config: &WindowConfig,
        gpu: Option<&Arc<Gpu>>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self, WindowError> {
        let shared = Arc::new(Shared::new(wake));
        let opened = opener.open(config, &shared)?;
        let (id, refresh_interval) = (opened.host, opened.refresh_interval);
        let drawn = canvas(opened, &shared).and_then(|canvas| {
            let (surface, way) = draw_on(&canvas, &config.format, gpu, &shared)?;
            Ok((canvas, surface, way))
        });
        let (canvas, surface, way) = drawn.inspect_err(|_| opener.close(id, &shared))?;
        let mut losses = Losses::default();
        losses.on_made(clock::now());
        Ok(Self {
            surface,
            way,
            gpu: gpu.map(Arc::clone),
            losses,
            next: Next::Nothing,
            canvas,
            format: config.format,
            shared,
            refresh_interval,
            id,
            opener: opener.clone(),
        })
    }

    /// Refresh interval that its monitor announces, if it announces one.
    #[must_use]
    pub fn refresh_interval(&self) -> Option<MonoSpan> {
        self.refresh_interval
    }

    /// How pictures get into it, and why not otherwise. For people.
    #[must_use]
    pub fn way(&self) -> &str {
        &self.way
    }

    /// Where it knows from when its frames were shown.
    #[must_use]
    pub fn feedback(&self) -> Feedback {
        match &self.canvas {
            Canvas::Wayland(face) => face.lock().unwrap_or_else(PoisonError::into_inner).feedback(),
            Canvas::Other { .. } => Feedback::Timer,
        }
    }

    /// Hands `frame` to the display, to be shown at `planned`; false if it cannot take one. Its
    /// fate comes as an event, where the display tells of it.
    pub fn present(&mut self, planned: MonoTime, frame: &ColorPlane) -> bool {
        if self.shared.is_closed() {
            return false;
        }
        self.make_surface_again();
        if let Surface::Gpu(surface) = &self.surface {
            match surface.present(planned, frame) {
                Ok(()) => return true,
                Err(why) => self.leave_surface(&why),
            }
        }
        match &mut self.surface {
            Surface::Wayland(surface) => surface.present(planned, frame),
            Surface::Software(painter) => painter.present(planned, frame),
            Surface::Gpu(_) | Surface::None => false,
        }
    }

    /// Whether a GPU draws, so that pictures need not leave it.
    #[must_use]
    pub fn takes_kept_pictures(&self) -> bool {
        matches!(self.surface, Surface::Gpu(_))
    }

    /// The same as [`present`](Self::present) for a picture that has stayed on the GPU.
    pub fn present_kept(&mut self, planned: MonoTime, picture: GpuPicture) -> bool {
        let Surface::Gpu(surface) = &self.surface else { return false };
        // Another surface is made with the device that makes the pictures.
        self.gpu = Some(Arc::clone(picture.gpu()));
        match surface.present_kept(planned, picture) {
            Ok(()) => !self.shared.is_closed(),
            Err(why) => {
                // This picture is lost; it is made again for the CPU.
                self.leave_surface(&why);
                false
            }
        }
    }

    /// Gives its surface up, as if the driver had lost it. For tests of what happens then.
    pub fn lose_surface(&self) {
        if let Surface::Gpu(surface) = &self.surface {
            surface.lose();
        }
    }

    /// The CPU draws from now on, until there is a surface again.
    fn leave_surface(&mut self, why: &SurfaceError) {
        // The surface goes before somebody else draws there.
        self.surface = Surface::None;
        match Surface::by_the_cpu(&self.canvas, &self.format, &self.shared) {
            Ok(surface) => self.surface = surface,
            Err(error) => warn!(%error, "the window stays as it is"),
        }
        self.wait_for_surface(why);
    }

    /// There is no surface. Says so, and whether there will be one.
    fn wait_for_surface(&mut self, why: &SurfaceError) {
        let now = clock::now();
        let wait = self.losses.on_loss(why, now);
        self.next = wait.map_or(Next::Nothing, |wait| Next::At(now + wait));
        let name = self.surface.name();
        self.way = match wait {
            Some(wait) => format!("{name}: {why}; another is made after {wait}"),
            None => format!("{name}: {why}"),
        };
        warn!(way = self.way, "another way into the window");
    }

    /// Makes a surface again, once its time has come.
    fn make_surface_again(&mut self) {
        let now = clock::now();
        let made = match &mut self.next {
            Next::Nothing => return,
            Next::At(at) if now < *at => return,
            Next::At(_) => {
                let gpu = self.gpu.as_ref().ok_or(SurfaceError::NoGpu);
                let canvas = self.canvas.clone();
                gpu.and_then(|gpu| Coming::begin(gpu, canvas, &self.format, &self.shared, now))
                    .map(|coming| self.next = Next::Coming(coming))
                    .map(|()| None)
            }
            Next::Coming(coming) => coming.poll(now).transpose(),
        };
        match made {
            Ok(None) => {}
            Ok(Some(surface)) => {
                self.way.clone_from(&surface.name);
                warn!(way = self.way, "the window has a surface again");
                self.surface = Surface::Gpu(surface);
                self.losses.on_made(now);
                self.next = Next::Nothing;
            }
            Err(why) => self.wait_for_surface(&why),
        }
    }

    /// What happened since the last call, in order.
    #[must_use]
    pub fn take_events(&self) -> Vec<WindowEvent> {
        self.shared.take_events()
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        self.opener.close(self.id, &self.shared);
    }
}

/// Where the pictures of a window go.
fn canvas(opened: Opened, shared: &Arc<Shared>) -> Result<Canvas, WindowError> {
    let Opened { window, pane, display, role, .. } = opened;
    match Guest::join(&window, &display) {
        Some(guest) => {
            let face = Face::new(guest, Arc::clone(shared), role)?;
            Ok(Canvas::Wayland(Arc::new(Mutex::new(face))))
        }
        None => Ok(Canvas::Other { window: pane, display }),
    }
}

/// What draws there, and that in words.
fn draw_on(
    canvas: &Canvas,
    format: &StreamFormat,
    gpu: Option<&Arc<Gpu>>,
    shared: &Arc<Shared>,
) -> Result<(Surface, String), WindowError> {
    let made = gpu.ok_or(SurfaceError::NoGpu);
    let made = made
        .and_then(|gpu| Coming::begin(gpu, canvas.clone(), format, shared, clock::now()))
        .and_then(Coming::wait);
    let (surface, way) = match made {
        Ok(surface) => {
            let way = surface.name.clone();
            (Surface::Gpu(surface), way)
        }
        Err(SurfaceError::NoAnswer) => return Err(WindowError::NoAnswer("none in 5 s")),
        Err(why) => {
            let surface = Surface::by_the_cpu(canvas, format, shared)?;
            let way = format!("{}: {why}", surface.name());
            (surface, way)
        }
    };
    info!(way, "window is drawn");
    Ok((surface, way))
}
