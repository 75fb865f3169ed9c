//! A surface inside the window's own, for a stream that shares a window.
//!
//! It is shown when it is committed, whatever the other surfaces do, and has frame callbacks and
//! presentation feedback of its own. Only its place is the window's to apply. It takes no input:
//! all of that goes to the window.

use wayland_client::QueueHandle;
use wayland_client::globals::GlobalList;
use wayland_client::protocol::wl_compositor::WlCompositor;
use wayland_client::protocol::wl_subcompositor::WlSubcompositor;
use wayland_client::protocol::wl_subsurface::WlSubsurface;
use wayland_client::protocol::wl_surface::WlSurface;

use super::listener::Listener;
use crate::sink::window::WindowError;

/// What a stream draws on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::sink::window) enum Role {
    /// The window's own surface.
    Whole,
    /// A surface inside it.
    Part,
    /// The window's own surface, behind such surfaces.
    Behind,
}

/// A surface inside a window, and its role there. Taken out of the window when dropped.
#[derive(Debug)]
pub(super) struct Cell {
    pub(super) surface: WlSurface,
    subsurface: WlSubsurface,
    window: WlSurface,
    /// Where it was put, in the desktop's own units. None before the first time.
    left: Option<u32>,
}

impl Cell {
    /// A new one inside `window`.
    pub(super) fn new(
        list: &GlobalList,
        handle: &QueueHandle<Listener>,
        window: &WlSurface,
    ) -> Result<Self, WindowError> {
        let compositor: WlCompositor =
            list.bind(handle, 1..=4, ()).map_err(|_| WindowError::Lacks("wl_compositor"))?;
        let subcompositor: WlSubcompositor =
            list.bind(handle, 1..=1, ()).map_err(|_| WindowError::Lacks("wl_subcompositor"))?;
        let surface = compositor.create_surface(handle, ());
        let nowhere = compositor.create_region(handle, ());
        surface.set_input_region(Some(&nowhere));
        nowhere.destroy();
        let subsurface = subcompositor.get_subsurface(&surface, window, handle, ());
        subsurface.set_desync();
        subcompositor.destroy();
        Ok(Self { surface, subsurface, window: window.clone(), left: None })
    }

    /// Puts it there, at the top.
    pub(super) fn put(&mut self, left: u32) {
        if self.left != Some(left) {
            self.left = Some(left);
            self.subsurface.set_position(left.cast_signed(), 0);
            self.window.commit();
        }
    }
}

impl Drop for Cell {
    fn drop(&mut self) {
        self.subsurface.destroy();
        self.surface.destroy();
    }
}
