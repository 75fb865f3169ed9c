//! One window of the desktop, and the streams that are shown in it: one, or several side by side.
//!
//! Each stream has a column of the window, all of the same width, the oldest at the left. With
//! several, each draws on a surface of its own inside the window and is told of its frames by
//! itself, so that none waits for another; the window's own surface is black.

use std::sync::Arc;

use foreframe_engine::MonoSpan;
use tracing::warn;
use winit::dpi::PhysicalSize;
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window as DesktopWindow;

use super::shared::{Column, Shared};
use super::wayland::{Backdrop, Role};
use super::{Closed, WindowConfig, WindowError, WindowEvent};

/// A window that is open.
pub(super) struct Host {
    /// Behind the streams where there may be several. Dropped before the window.
    backdrop: Option<Backdrop>,
    pub(super) window: Arc<DesktopWindow>,
    pub(super) refresh_interval: Option<MonoSpan>,
    /// From left to right.
    streams: Vec<Stream>,
}

/// A stream that is shown.
struct Stream {
    shared: Arc<Shared>,
    config: WindowConfig,
}

impl Host {
    /// For one stream alone.
    pub(super) fn new(window: Arc<DesktopWindow>, refresh_interval: Option<MonoSpan>) -> Self {
        Self { backdrop: None, window, refresh_interval, streams: Vec::new() }
    }

    /// For any number of them.
    ///
    /// # Errors
    /// If the display does not answer, or lacks what streams need to share a window.
    pub(super) fn for_several(
        window: Arc<DesktopWindow>,
        display: &OwnedDisplayHandle,
        refresh_interval: Option<MonoSpan>,
    ) -> Result<Self, WindowError> {
        let backdrop = Backdrop::new(&window, display)?;
        Ok(Self { backdrop: Some(backdrop), window, refresh_interval, streams: Vec::new() })
    }

    /// What its streams draw on.
    pub(super) fn role(&self) -> Role {
        if self.backdrop.is_some() { Role::Part } else { Role::Whole }
    }

    /// Shows a stream beside the others. The window becomes as large as all need.
    pub(super) fn add(&mut self, shared: Arc<Shared>, config: WindowConfig) {
        let at = self.streams.partition_point(|it| it.config.ordinal <= config.ordinal);
        self.streams.insert(at, Stream { shared, config });
        if self.streams.len() > 1 {
            self.resize();
        }
        self.arrange();
    }

    /// Whether any stream is left without this one.
    pub(super) fn remove(&mut self, shared: &Arc<Shared>) -> bool {
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
            stream.shared.set_place(size, scale, Column { index, count });
        }
        if let Some(backdrop) = &mut self.backdrop
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
