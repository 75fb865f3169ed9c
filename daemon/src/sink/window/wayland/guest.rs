//! A guest on the desktop window's own Wayland connection: the only `unsafe` code of windows.
//!
//! Frames have to go to the surface that winit has made, which only pointers lead to. What keeps
//! them valid is held here, in the order in which it has to go: our connection before the window,
//! and the window before the display. A queue of a display that is gone would be a crash.
//!
//! Graphics drivers want such pointers, too: [`Target`] lends them.

use std::fmt;
use std::ptr::NonNull;
use std::sync::Arc;

use raw_window_handle::{
    DisplayHandle, HandleError, HasDisplayHandle, HasWindowHandle, RawDisplayHandle,
    RawWindowHandle, WaylandWindowHandle, WindowHandle,
};
use tracing::warn;
use wayland_backend::client::{Backend, ObjectId};
use wayland_client::protocol::wl_surface::WlSurface;
use wayland_client::{Connection, Proxy as _};
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window as DesktopWindow;

/// Our connection and the window's surface on it. Whoever has a queue of it drops that first.
pub(super) struct Anchor {
    _window: Arc<DesktopWindow>,
    display: OwnedDisplayHandle,
}

/// A second connection to a display that is already connected.
pub(in crate::sink::window) struct Guest {
    pub(super) surface: WlSurface,
    pub(super) connection: Connection,
    /// Dropped after the two above.
    pub(super) anchor: Anchor,
}

/// A surface of the window as graphics drivers are given it.
pub(in crate::sink::window) struct Target {
    surface: WlSurface,
    anchor: Arc<Anchor>,
}

impl Target {
    /// `anchor` is that of the connection that `surface` is on.
    pub(super) fn new(surface: &WlSurface, anchor: &Arc<Anchor>) -> Self {
        Self { surface: surface.clone(), anchor: Arc::clone(anchor) }
    }
}

impl HasDisplayHandle for Target {
    fn display_handle(&self) -> Result<DisplayHandle<'_>, HandleError> {
        self.anchor.display.display_handle()
    }
}

impl HasWindowHandle for Target {
    fn window_handle(&self) -> Result<WindowHandle<'_>, HandleError> {
        let pointer = NonNull::new(self.surface.id().as_ptr()).ok_or(HandleError::Unavailable)?;
        let raw = RawWindowHandle::Wayland(WaylandWindowHandle::new(pointer.cast()));
        // SAFETY: the pointer is a `wl_surface` that was alive a moment ago, by the mark that it
        // shares with whoever destroys it. The window's own lives as long as `anchor`; one inside
        // the window is destroyed by the `Face` that it belongs to, which whoever draws on it
        // keeps, and drops after what it draws with.
        Ok(unsafe { WindowHandle::borrow_raw(raw) })
    }
}

impl fmt::Debug for Anchor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Anchor").finish_non_exhaustive()
    }
}

impl Guest {
    /// Joins the connection of `window`; None where it is not on Wayland.
    pub(in crate::sink::window) fn join(
        window: &Arc<DesktopWindow>,
        display: &OwnedDisplayHandle,
    ) -> Option<Self> {
        let RawDisplayHandle::Wayland(raw_display) = display.display_handle().ok()?.as_raw() else {
            return None;
        };
        let RawWindowHandle::Wayland(raw_window) = window.window_handle().ok()?.as_raw() else {
            return None;
        };
        let anchor = Anchor { _window: Arc::clone(window), display: display.clone() };
        // SAFETY: the pointer is a live `wl_display`, because winit says so of a handle that it
        // lends, and stays one: `anchor` owns the display and is dropped after the connection, here
        // and in every struct that takes this one apart.
        let backend = unsafe { Backend::from_foreign_display(raw_display.display.as_ptr().cast()) };
        let connection = Connection::from_backend(backend);
        // SAFETY: the pointer is the live `wl_surface` of `window`, which `anchor` keeps. winit
        // makes it with the same copy of `wayland-backend` (a test counts the copies), so that the
        // id shares its mark of life and is refused, not followed, once the surface is gone.
        let id = unsafe {
            ObjectId::from_ptr(WlSurface::interface(), raw_window.surface.as_ptr().cast())
        };
        match id.and_then(|id| WlSurface::from_id(&connection, id)) {
            Ok(surface) => Some(Self { surface, connection, anchor }),
            Err(error) => {
                warn!(%error, "the window's surface cannot be used directly");
                None
            }
        }
    }
}
