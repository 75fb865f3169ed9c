//! One stream as the client keeps it: its pool, and whose each slot is.

use std::sync::mpsc::{Receiver, Sender, channel};

use foreframe_protocol::limits::SLOT_ALIGN;
use foreframe_protocol::memory::{SlotMemory, WritablePool};
use foreframe_protocol::slots::KeyOrder;
use foreframe_protocol::{
    CreateStream, PlaneDescriptor, PlaneKind, PlaneMap, PlaneSize, SlotReleased, Statistics,
};

use crate::error::Result;
use crate::frame::KeyFrame;

/// Planes start at a multiple of this many bytes in a slot, which suits read-backs and vectors.
const PLANE_ALIGN: u64 = 256;

/// How far a stream has come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum StreamState {
    /// The daemon has not answered yet. Key frames may be submitted already.
    Pending,
    /// The daemon has mapped the pool.
    Ready,
    /// No more key frames can be submitted.
    Ended,
}

/// Where a plane lies in each slot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct PlanePlace {
    pub(crate) offset: u64,
    pub(crate) max_size: PlaneSize,
    pub(crate) bytes_per_pixel: u32,
}

/// Places of all planes of a stream, in the order of their kinds, largest size each.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct SlotLayout {
    pub(crate) places: PlaneMap<PlanePlace>,
    pub(crate) slot_bytes: u64,
    row_align: u32,
}

impl SlotLayout {
    pub(crate) fn new(create: &CreateStream, row_align: u32) -> Self {
        let mut end = 0_u64;
        let places = PlaneMap::from_fn(|kind| {
            let max_size = *create.max_sizes.get(kind)?;
            let bytes_per_pixel = create.format.bytes_per_pixel(kind)?;
            let offset = end;
            let stride = row_stride(max_size.width, bytes_per_pixel, row_align);
            let bytes = u64::from(stride) * u64::from(max_size.height);
            end = (offset + bytes).next_multiple_of(PLANE_ALIGN);
            Some(PlanePlace { offset, max_size, bytes_per_pixel })
        });
        Self { places, slot_bytes: end.next_multiple_of(SLOT_ALIGN), row_align }
    }

    /// A plane of this size at its place. `kind` is one that the stream has.
    pub(crate) fn describe(&self, kind: PlaneKind, size: PlaneSize) -> PlaneDescriptor {
        let (offset, bytes_per_pixel) =
            self.places.get(kind).map_or((0, 1), |place| (place.offset, place.bytes_per_pixel));
        let stride = row_stride(size.width, bytes_per_pixel, self.row_align);
        PlaneDescriptor { stride, ..PlaneDescriptor::packed(offset, size, bytes_per_pixel) }
    }
}

fn row_stride(width: u32, bytes_per_pixel: u32, row_align: u32) -> u32 {
    // A power of two on either side, so that the larger one is a multiple of both.
    (width * bytes_per_pixel).next_multiple_of(row_align.max(bytes_per_pixel))
}

/// A stream between `create_stream` and its end.
#[derive(Debug)]
pub(crate) struct Stream {
    pub(crate) create: CreateStream,
    pub(crate) layout: SlotLayout,
    pub(crate) state: StreamState,
    pub(crate) order: KeyOrder,
    pub(crate) skipped_keys: u64,
    /// `ui_index` of the next UI plane.
    pub(crate) next_ui: u64,
    pub(crate) statistics: Option<Statistics>,
    pool: WritablePool,
    free: Vec<SlotMemory>,
    with_daemon: Vec<(u64, SlotMemory)>,
    returned: Receiver<SlotMemory>,
    home: Sender<SlotMemory>,
}

impl Stream {
    /// Allocates the pool: about half a millisecond per megabyte.
    pub(crate) fn new(create: CreateStream, layout: SlotLayout) -> Result<Self> {
        let name = format!("foreframe-stream-{}", create.stream);
        let (pool, free) = WritablePool::allocate(&name, create.slots, layout.slot_bytes)?;
        let (home, returned) = channel();
        Ok(Self {
            create,
            layout,
            state: StreamState::Pending,
            order: KeyOrder::default(),
            skipped_keys: 0,
            next_ui: 0,
            statistics: None,
            pool,
            free,
            with_daemon: Vec::new(),
            returned,
            home,
        })
    }

    pub(crate) fn pool(&self) -> &WritablePool {
        &self.pool
    }

    /// A free slot, unless it is the last one.
    pub(crate) fn acquire_beside_keys(&mut self) -> Option<KeyFrame> {
        self.free.extend(self.returned.try_iter());
        if self.free.len() > 1 { self.acquire() } else { None }
    }

    /// A free slot as a key frame.
    pub(crate) fn acquire(&mut self) -> Option<KeyFrame> {
        self.free.extend(self.returned.try_iter());
        let memory = self.free.pop()?;
        Some(KeyFrame::new(self.create.stream, self.layout, memory, self.home.clone()))
    }

    /// The daemon has this slot now.
    pub(crate) fn on_submitted(&mut self, key_index: u64, frame: &mut KeyFrame) {
        if let Some(memory) = frame.take_memory() {
            self.with_daemon.push((key_index, memory));
        }
    }

    /// The daemon gave a slot back; false if it did not have it.
    pub(crate) fn on_released(&mut self, released: &SlotReleased) -> bool {
        let found = self.with_daemon.iter().position(|(key_index, memory)| {
            *key_index == released.key_index && memory.index() == released.slot
        });
        let Some(found) = found else { return false };
        let (_, memory) = self.with_daemon.swap_remove(found);
        self.free.push(memory);
        true
    }
}
