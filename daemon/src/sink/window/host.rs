//! One window of the desktop, and the streams that are shown in it: one, or several side by side.
//!
//! Each stream has a column of the window, all of the same width, the oldest at the left. With
//! several, each draws on something of its own inside the window and is told of its frames by
//! itself, so that none waits for another: on Wayland on a surface, with black behind it, on X11 on
//! a window ([`Pane`]), which fills its column.

use std::sync::Arc;

use foreframe_engine::MonoSpan;
use tracing::warn;
use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::platform::wayland::ActiveEventLoopExtWayland as _;
use winit::window::{Window as DesktopWindow, WindowId};

use super::pane::Pane;
use super::shared::{Column, Shared};
use super::wayland::{Backdrop, Role};
use super::{Closed, WindowConfig, WindowError, WindowEvent};

/// A window that is open.
pub(super) struct Host {
    inside: Inside,
    pub(super) window: Arc<DesktopWindow>,
    pub(super) refresh_interval: Option<MonoSpan>,
    /// From left to right.
    streams: Vec<Stream>,
}

/// What streams draw on. Dropped before the window.
enum Inside {
    /// The window's own surface: there is one stream.
    Nothing,
    /// Surfaces of Wayland, with this behind them.
    Surfaces(Box<Backdrop>),
    /// Windows of X11.
    Windows,
}

/// A stream that is shown.
struct Stream {
    shared: Arc<Shared>,
    config: WindowConfig,
    pane: Pane,
}

impl Host {
    /// For one stream alone.
    pub(super) fn new(window: Arc<DesktopWindow>, refresh_interval: Option<MonoSpan>) -> Self {
        Self { inside: Inside::Nothing, window, refresh_interval, streams: Vec::new() }
    }

    /// For any number of them.
    ///
    /// # Errors
    /// If the display does not answer, or lacks what streams need to share a window.
    pub(super) fn for_several(
        window: Arc<DesktopWindow>,
        display: &ActiveEventLoop,
        refresh_interval: Option<MonoSpan>,
    ) -> Result<Self, WindowError> {
        let inside = match display.is_wayland() {
            true => {
                let backdrop = Backdrop::new(&window, &display.owned_display_handle())?;
                Inside::Surfaces(Box::new(backdrop))
            }
            false => Inside::Windows,
        };
        Ok(Self { inside, window, refresh_interval, streams: Vec::new() })
    }

    /// What its streams draw on.
    pub(super) fn role(&self) -> Role {
        match self.inside {
            Inside::Surfaces(_) => Role::Part,
            Inside::Nothing | Inside::Windows => Role::Whole,
        }
    }

    /// Shows a stream beside the others: where it draws without Wayland. The window becomes as
    /// large as all need.
    ///
    /// # Errors
    /// If the display refuses.
    pub(super) fn add(
        &mut self,
        display: &ActiveEventLoop,
        shared: Arc<Shared>,
        config: WindowConfig,
    ) -> Result<Pane, WindowError> {
        let pane = match self.inside {
            Inside::Windows => Pane::inside(&self.window, display)?,
            Inside::Nothing | Inside::Surfaces(_) => Pane::whole(Arc::clone(&self.window)),
        };
        let at = self.streams.partition_point(|it| it.config.ordinal <= config.ordinal);
        self.streams.insert(at, Stream { shared, config, pane: pane.clone() });
        if self.streams.len() > 1 {
            self.resize();
        }
        self.arrange();
        Ok(pane)
    }

    /// Whether a stream draws on the window of this name, inside this one.
    pub(super) fn has_inside(&self, id: WindowId) -> bool {
        self.streams.iter().any(|stream| stream.pane.id() == id)
    }

    /// Whether no stream is shown.
    pub(super) fn is_empty(&self) -> bool {
        self.streams.is_empty()
    }

    /// Whether any stream is left without this one.
    pub(super) fn remove(&mut self, shared: &Arc<Shared>) -> bool {
        // Who draws in it may hold its pane for longer, over those of the others.
        let inside = matches!(self.inside, Inside::Windows);
        let ended = self.streams.iter().filter(|stream| Arc::ptr_eq(&stream.shared, shared));
        ended.filter(|_| inside).for_each(|stream| stream.pane.hide());
        self.streams.retain(|stream| !Arc::ptr_eq(&stream.shared, shared));
        if !self.streams.is_empty() {
            self.resize();
            self.arrange();
        }
        !self.streams.is_empty()
    }

    fn resize(&self) {
        if self.window.fullscreen().is_some() {
            return;
        }
        let formats = || self.streams.iter().map(|stream| &stream.config.format);
        let widest = formats().map(|format| format.width).max().unwrap_or(1);
        let tallest = formats().map(|format| format.height).max().unwrap_or(1);
        let count = u32::try_from(self.streams.len()).unwrap_or(u32::MAX);
        let size = PhysicalSize::new(widest.saturating_mul(count), tallest);
        // Where the display has the last word, it comes as an event.
        let _granted = self.window.request_inner_size(size);
    }

    /// Tells each stream its place, after the window or the streams have changed.
    pub(super) fn arrange(&mut self) {
        let (size, scale) = (self.window.inner_size(), self.window.scale_factor());
        let count = u32::try_from(self.streams.len()).unwrap_or(u32::MAX);
        for (index, stream) in (0..count).zip(&self.streams) {
            let column = Column { index, count };
            if let Inside::Windows = self.inside {
                stream.pane.put(size, column);
            }
            stream.shared.set_place(size, scale, column);
        }
        if let Inside::Surfaces(backdrop) = &mut self.inside
            && !backdrop.fill(size, scale)
        {
            warn!("what is behind the streams cannot be drawn");
        }
    }

    pub(super) fn tell(&self, event: WindowEvent) {
        self.streams.iter().for_each(|stream| stream.shared.tell(event));
    }

    pub(super) fn close(&self, why: Closed) {
        self.streams.iter().for_each(|stream| stream.shared.close(why));
    }
}
