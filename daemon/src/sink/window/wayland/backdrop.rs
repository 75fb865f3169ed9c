//! What is behind the streams that share a window: black, as large as the window.
//!
//! A window is shown once its own surface has a picture, and the surfaces inside it with it. This
//! one never changes but with the window's size.

use std::sync::{Arc, Mutex};

use foreframe_engine::{ColorPlane, MonoTime, StreamFormat};
use winit::dpi::PhysicalSize;
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window as DesktopWindow;

use super::cell::Role;
use super::face::Face;
use super::guest::Guest;
use super::surface::WaylandSurface;
use crate::sink::window::WindowError;
use crate::sink::window::shared::{Column, Shared};

/// The black of one window.
pub(in crate::sink::window) struct Backdrop {
    surface: WaylandSurface,
    shared: Arc<Shared>,
    black: ColorPlane,
}

impl Backdrop {
    /// For a window that is on Wayland.
    ///
    /// # Errors
    /// If the display does not answer, or lacks what streams need to share a window.
    pub(in crate::sink::window) fn new(
        window: &Arc<DesktopWindow>,
        display: &OwnedDisplayHandle,
    ) -> Result<Self, WindowError> {
        let guest = Guest::join(window, display).ok_or(WindowError::Lacks("Wayland"))?;
        // Nobody waits for what happens to it.
        let shared = Arc::new(Shared::new(|| {}));
        let format = StreamFormat::rgba8(1, 1);
        let face = Face::new(guest, Arc::clone(&shared), Role::Behind)?;
        let surface = WaylandSurface::new(Arc::new(Mutex::new(face)), &format);
        Ok(Self { surface, shared, black: ColorPlane::new(format.color, 1, 1) })
    }

    /// Fills a window of this size; false where it cannot.
    pub(in crate::sink::window) fn fill(&mut self, size: PhysicalSize<u32>, scale: f64) -> bool {
        self.shared.set_place(size, scale, Column::WHOLE);
        drop(self.shared.take_events());
        // Black is black in any size: where no buffer is free, the one that is shown will do.
        self.surface.present(MonoTime::ZERO, &self.black) || self.surface.stretch_shown()
    }
}
