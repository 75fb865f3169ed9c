//! What a stream draws on where there is no Wayland: the desktop's window, or one inside it.
//!
//! On X11 a window inside another is shown, drawn and replaced by itself, so that streams which
//! share a window do not wait for each other. Its place is its [`Host`](super::host::Host)'s to
//! say. What happens to the window around it does not reach it, and is followed there.

use std::sync::Arc;

use raw_window_handle::{
    DisplayHandle, HandleError, HasDisplayHandle, HasWindowHandle, RawWindowHandle, WindowHandle,
};
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event_loop::ActiveEventLoop;
use winit::platform::x11::WindowAttributesExtX11 as _;
use winit::window::{Window as DesktopWindow, WindowAttributes, WindowId};

use super::WindowError;
use super::shared::Column;

/// A window that is drawn on.
#[derive(Clone, Debug)]
pub(super) struct Pane {
    window: Arc<DesktopWindow>,
    /// Dropped after what is inside it.
    _around: Option<Arc<DesktopWindow>>,
}

impl Pane {
    /// All of a window of the desktop.
    pub(super) fn whole(window: Arc<DesktopWindow>) -> Self {
        Self { window, _around: None }
    }

    /// A new window inside `around`, which is on X11.
    ///
    /// # Errors
    /// If the display refuses.
    pub(super) fn inside(
        around: &Arc<DesktopWindow>,
        display: &ActiveEventLoop,
    ) -> Result<Self, WindowError> {
        let lacks = WindowError::Lacks("windows inside windows");
        let id = match around.window_handle().map(|handle| handle.as_raw()) {
            Ok(RawWindowHandle::Xlib(handle)) => u32::try_from(handle.window).map_err(|_| lacks)?,
            Ok(RawWindowHandle::Xcb(handle)) => handle.window.get(),
            _ => return Err(lacks),
        };
        let attributes = WindowAttributes::default()
            .with_inner_size(around.inner_size())
            .with_embed_parent_window(id);
        let window = display.create_window(attributes);
        let window = window.map_err(|error| WindowError::Refused(error.to_string()))?;
        Ok(Self { window: Arc::new(window), _around: Some(Arc::clone(around)) })
    }

    /// Puts it into its column of the window around it, which has this size.
    pub(super) fn put(&self, size: PhysicalSize<u32>, column: Column) {
        let [left, width] = column.of(size.width);
        self.window.set_outer_position(PhysicalPosition::new(left, 0));
        // No window has a side of 0; this display grants any other at once.
        let size = PhysicalSize::new(width.max(1), size.height.max(1));
        let _granted = self.window.request_inner_size(size);
    }

    /// Takes it off the screen.
    pub(super) fn hide(&self) {
        self.window.set_visible(false);
    }

    pub(super) fn id(&self) -> WindowId {
        self.window.id()
    }
}

impl HasWindowHandle for Pane {
    fn window_handle(&self) -> Result<WindowHandle<'_>, HandleError> {
        self.window.window_handle()
    }
}

impl HasDisplayHandle for Pane {
    fn display_handle(&self) -> Result<DisplayHandle<'_>, HandleError> {
        self.window.display_handle()
    }
}
