//! What the threads around one window share: the stream's, the desktop's, and the one that listens.

use std::fmt;
use std::mem;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use winit::dpi::{LogicalSize, PhysicalSize};

use super::{Closed, WindowEvent};

/// A mailbox of events, and the window's size.
pub(super) struct Shared {
    events: Mutex<Vec<WindowEvent>>,
    wake: Box<dyn Fn() + Send + Sync>,
    /// Columns and rows of the window, in pixels, 32 bits each.
    size: AtomicU64,
    /// The same in the desktop's own units.
    logical_size: AtomicU64,
    is_closed: AtomicBool,
}

impl fmt::Debug for Shared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Shared").field("size", &self.size()).finish_non_exhaustive()
    }
}

impl Shared {
    /// `wake` is called on any thread when there are events to take; it must not block.
    pub(super) fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            events: Mutex::default(),
            wake: Box::new(wake),
            size: AtomicU64::new(0),
            logical_size: AtomicU64::new(0),
            is_closed: AtomicBool::new(false),
        }
    }

    pub(super) fn tell(&self, event: WindowEvent) {
        self.events.lock().unwrap_or_else(PoisonError::into_inner).push(event);
        (self.wake)();
    }

    /// What happened since the last call, in order.
    pub(super) fn take_events(&self) -> Vec<WindowEvent> {
        mem::take(&mut *self.events.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Tells it once, whoever finds out first.
    pub(super) fn close(&self, why: Closed) {
        if !self.is_closed.swap(true, Ordering::Relaxed) {
            self.tell(WindowEvent::Closed(why));
        }
    }

    pub(super) fn is_closed(&self) -> bool {
        self.is_closed.load(Ordering::Relaxed)
    }

    /// The window has `size` pixels, and `scale` of them for each of the desktop's own units.
    pub(super) fn set_size(&self, size: PhysicalSize<u32>, scale: f64) {
        let logical: LogicalSize<u32> = size.to_logical(scale);
        self.size.store(packed(size.into()), Ordering::Relaxed);
        self.logical_size.store(packed(logical.into()), Ordering::Relaxed);
    }

    /// Columns and rows of the window, in pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        unpacked(self.size.load(Ordering::Relaxed))
    }

    /// The same in the desktop's own units.
    pub(super) fn logical_size(&self) -> [u32; 2] {
        unpacked(self.logical_size.load(Ordering::Relaxed))
    }
}

fn packed([width, height]: [u32; 2]) -> u64 {
    u64::from(width) << 32 | u64::from(height)
}

#[expect(clippy::cast_possible_truncation, reason = "each half has 32 bits")]
fn unpacked(size: u64) -> [u32; 2] {
    [(size >> 32) as u32, size as u32]
}
