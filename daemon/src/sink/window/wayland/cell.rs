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
}

/// The role of a surface inside a window.
#[derive(Debug)]
pub(super) struct Cell {
    subsurface: WlSubsurface,
    window: WlSurface,
    /// Where it was put, in the desktop's own units. None before the first time.
    left: Option<u32>,
}

impl Cell {
    /// A new surface inside `window`, and its role there.
    pub(super) fn new(
        list: &GlobalList,
        handle: &QueueHandle<Listener>,
        window: &WlSurface,
    ) -> Result<(WlSurface, Self), WindowError> {
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
        Ok((surface, Self { subsurface, window: window.clone(), left: None }))
    }

    /// Puts it there, at the top.
    pub(super) fn put(&mut self, left: u32) {
        if self.left != Some(left) {
            self.left = Some(left);
            self.subsurface.set_position(left.cast_signed(), 0);
            self.window.commit();
        }
    }

    /// Takes `surface` out of the window.
    pub(super) fn remove(&self, surface: &WlSurface) {
        self.subsurface.destroy();
        surface.destroy();
    }
}
