//! One window, as its stream has it.

use std::sync::Arc;

use foreframe_engine::{ColorPlane, MonoSpan, MonoTime};
use winit::window::WindowId;

use super::shared::Shared;
use super::software::Painter;
use super::system::{Opened, WindowOpener};
use super::wayland::{Guest, WaylandSurface};
use super::{Feedback, WindowConfig, WindowError, WindowEvent};

/// An open window. Closed when dropped.
#[derive(Debug)]
pub struct Window {
    surface: Surface,
    shared: Arc<Shared>,
    refresh_interval: Option<MonoSpan>,
    id: WindowId,
    opener: WindowOpener,
}

/// How pictures get into it.
#[derive(Debug)]
enum Surface {
    Wayland(Box<WaylandSurface>),
    Software(Painter),
}

impl Window {
    /// Opens a window. `wake` is called on other threads when there are events to take; it must
    /// not block.
    ///
    /// # Errors
    /// If the display is gone, does not answer in time, or lacks what a window needs.
    pub fn open(
        opener: &WindowOpener,
        config: &WindowConfig,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self, WindowError> {
        let shared = Arc::new(Shared::new(wake));
        let Opened { window, display, refresh_interval, role } = opener.open(config, &shared)?;
        let id = window.id();
        let surface = match Guest::join(&window, &display) {
            Some(guest) => WaylandSurface::new(guest, &config.format, Arc::clone(&shared), role)
                .map(|surface| Surface::Wayland(Box::new(surface))),
            None => Painter::start(window, display, &config.format, Arc::clone(&shared))
                .map(Surface::Software),
        };
        let surface = surface.inspect_err(|_| opener.close(id, &shared))?;
        Ok(Self { surface, shared, refresh_interval, id, opener: opener.clone() })
    }

    /// Refresh interval that its monitor announces, if it announces one.
    #[must_use]
    pub fn refresh_interval(&self) -> Option<MonoSpan> {
        self.refresh_interval
    }

    /// Where it knows from when its frames were shown.
    #[must_use]
    pub fn feedback(&self) -> Feedback {
        match &self.surface {
            Surface::Wayland(surface) => surface.feedback(),
            Surface::Software(_) => Feedback::Timer,
        }
    }

    /// Hands `frame` to the display, to be shown at `planned`; false if it cannot take one. Its
    /// fate comes as an event, where the display tells of it.
    pub fn present(&mut self, planned: MonoTime, frame: &ColorPlane) -> bool {
        if self.shared.is_closed() {
            return false;
        }
        match &mut self.surface {
            Surface::Wayland(surface) => surface.present(planned, frame),
            Surface::Software(painter) => painter.present(frame),
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
