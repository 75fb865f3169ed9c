//! What the threads around one window share: the stream's, the desktop's, and the one that listens.

use std::fmt;
use std::mem;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use winit::dpi::{LogicalSize, PhysicalSize};

use super::{Closed, WindowEvent};
use crate::stream::core::Told;

/// A part of the desktop's window: one of `count` columns of the same width, from the left.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Column {
    pub(super) index: u32,
    pub(super) count: u32,
}

impl Column {
    /// All of it.
    pub(super) const WHOLE: Self = Self { index: 0, count: 1 };

    /// Where it begins in a window of this width, and its own width.
    pub(super) fn of(self, width: u32) -> [u32; 2] {
        let at = |index: u32| {
            let at = u64::from(width) * u64::from(index) / u64::from(self.count.max(1));
            u32::try_from(at).unwrap_or(width)
        };
        [at(self.index), at(self.index + 1) - at(self.index)]
    }
}

/// A mailbox of events, and the place of the stream's window, which may be a part of the desktop's.
pub(super) struct Shared {
    events: Mutex<Vec<WindowEvent>>,
    wake: Box<dyn Fn() + Send + Sync>,
    /// Columns and rows of the window, in pixels, 32 bits each.
    size: AtomicU64,
    /// The same in the desktop's own units.
    logical_size: AtomicU64,
    /// Where it begins in the desktop's window, in the same units.
    left: AtomicU32,
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
            left: AtomicU32::new(0),
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

    /// The desktop's window has `size` pixels, and `scale` of them for each of the desktop's own
    /// units; `column` of it is ours. Tells if that is another place than before: a picture takes
    /// the place that there is when it is handed over, and of an idle stream none may come.
    pub(super) fn set_place(&self, size: PhysicalSize<u32>, scale: f64, column: Column) {
        let logical: LogicalSize<u32> = size.to_logical(scale);
        let [_, width] = column.of(size.width);
        let [left, logical_width] = column.of(logical.width);
        let size = packed([width, size.height]);
        let logical_size = packed([logical_width, logical.height]);
        let was_left = self.left.swap(left, Ordering::Relaxed);
        let was_size = self.size.swap(size, Ordering::Relaxed);
        let was_logical_size = self.logical_size.swap(logical_size, Ordering::Relaxed);
        if (was_left, was_size, was_logical_size) != (left, size, logical_size) {
            self.tell(WindowEvent::Told(Told::Moved));
        }
    }

    /// Where the window begins in the desktop's, in the desktop's own units.
    pub(super) fn left(&self) -> u32 {
        self.left.load(Ordering::Relaxed)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_fill_the_window_side_by_side() {
        for count in 1..5 {
            for width in [1, 7, 640, 1281] {
                let columns = (0..count).map(|index| Column { index, count }.of(width));
                let end = columns.fold(0, |end, [left, across]| {
                    assert_eq!(left, end, "column {left} of {width} in {count}");
                    left + across
                });
                assert_eq!(end, width);
            }
        }
        assert_eq!(Column { index: 1, count: 2 }.of(1280), [640, 640]);
    }

    #[test]
    fn a_place_is_in_pixels_and_in_the_desktops_units() {
        let shared = Shared::new(|| {});
        shared.set_place(PhysicalSize::new(1600, 600), 2.0, Column { index: 1, count: 2 });
        assert_eq!(
            (shared.size(), shared.logical_size(), shared.left()),
            ([800, 600], [400, 300], 400)
        );
    }

    #[test]
    fn another_place_is_told_and_the_same_place_is_not() {
        let shared = Shared::new(|| {});
        let column = |index| Column { index, count: 2 };
        let set = |width, scale, index| {
            shared.set_place(PhysicalSize::new(width, 600), scale, column(index));
            shared.take_events()
        };
        let moved = [WindowEvent::Told(Told::Moved)];
        for (width, scale, index) in [(800, 1.0, 0), (800, 1.0, 1), (800, 2.0, 1), (900, 2.0, 1)] {
            assert_eq!(set(width, scale, index), moved, "{width} {scale} {index}");
            assert_eq!(set(width, scale, index), [], "{width} {scale} {index}");
        }
    }
}
