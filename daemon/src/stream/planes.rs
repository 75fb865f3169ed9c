//! The planes of a key, or a UI plane by itself, on their way out of a slot.
//!
//! Every byte is copied out of shared memory before it is used. The engine does that itself,
//! row by row, while it converts ([`SlotPlanes`]); where a recorder needs the planes as they came,
//! they are copied whole, and the copy is read by engine and recorder alike ([`PlaneCopier`]).

use std::sync::Arc;

use foreframe_engine::ReadPixels;
use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::{Error, PlaneDescriptor, PlaneKind, PlaneMap, StreamFormat};

/// The planes of one key, rows without padding.
#[derive(Debug, Default)]
pub struct KeyPlanes {
    bytes: PlaneMap<Vec<u8>>,
    present: u32,
}

impl KeyPlanes {
    /// The pixels of a plane; None where the key has none.
    #[must_use]
    pub fn get(&self, kind: PlaneKind) -> Option<&[u8]> {
        let bytes = self.bytes.get(kind)?;
        (self.present & kind.bit() != 0).then_some(bytes)
    }

    fn copy(
        &mut self,
        format: &StreamFormat,
        described: &PlaneMap<PlaneDescriptor>,
        pool: &ReadOnlyPool,
        slot_offset: u64,
    ) -> Result<(), Error> {
        self.present = 0;
        for (kind, plane) in described.iter() {
            let Some(bytes_per_pixel) = format.bytes_per_pixel(kind) else { continue };
            let mut bytes = self.bytes.get_mut(kind).map(std::mem::take).unwrap_or_default();
            let row_bytes = plane.width.saturating_mul(bytes_per_pixel);
            let offset = slot_offset.saturating_add(plane.offset);
            pool.copy_rows_to_vec(offset, plane.stride, row_bytes, plane.height, &mut bytes)?;
            self.bytes.set(kind, Some(bytes));
            self.present |= kind.bit();
        }
        Ok(())
    }
}

/// The planes of one key, still in its slot.
#[derive(Debug)]
pub struct SlotPlanes<'a> {
    planes: PlaneMap<SlotPlane<'a>>,
}

#[derive(Debug)]
struct SlotPlane<'a> {
    pool: &'a ReadOnlyPool,
    offset: u64,
    bytes: u64,
}

impl<'a> SlotPlanes<'a> {
    /// The planes of a key, of which the slot starts at `slot_offset`.
    ///
    /// # Errors
    /// If a plane leaves the pool, which a checked submission does not.
    pub fn new(
        format: &StreamFormat,
        described: &PlaneMap<PlaneDescriptor>,
        pool: &'a ReadOnlyPool,
        slot_offset: u64,
    ) -> Result<Self, Error> {
        let mut planes = PlaneMap::default();
        for (kind, plane) in described.iter() {
            let Some(bytes_per_pixel) = format.bytes_per_pixel(kind) else { continue };
            let row = u64::from(plane.width) * u64::from(bytes_per_pixel);
            let rows_before = u64::from(plane.height.saturating_sub(1));
            let bytes = rows_before * u64::from(plane.stride) + row;
            let offset = slot_offset.saturating_add(plane.offset);
            pool.check_range(offset, bytes)?;
            planes.set(kind, Some(SlotPlane { pool, offset, bytes }));
        }
        Ok(Self { planes })
    }

    /// Reads the pixels of a plane; None where the key has none.
    #[must_use]
    pub fn get(&self, kind: PlaneKind) -> Option<&dyn ReadPixels> {
        self.planes.get(kind).map(|plane| plane as &dyn ReadPixels)
    }
}

impl ReadPixels for SlotPlane<'_> {
    fn byte_count(&self) -> u64 {
        self.bytes
    }

    fn read(&self, offset: u64, out: &mut [u8]) {
        self.pool
            .copy_to(self.offset.saturating_add(offset), out)
            .expect("the whole plane was found to lie in the pool");
    }
}

/// Makes copies, in memory that it takes back when nobody reads it any more.
#[derive(Debug, Default)]
pub struct PlaneCopier {
    copies: Vec<Arc<KeyPlanes>>,
}

impl PlaneCopier {
    /// Copies the planes of a key out of its slot.
    ///
    /// # Errors
    /// If a plane leaves the pool, which a checked submission does not.
    pub fn copy(
        &mut self,
        format: &StreamFormat,
        described: &PlaneMap<PlaneDescriptor>,
        pool: &ReadOnlyPool,
        slot_offset: u64,
    ) -> Result<Arc<KeyPlanes>, Error> {
        let is_unread = |copy: &Arc<KeyPlanes>| Arc::strong_count(copy) == 1;
        let mut copy = match self.copies.iter().position(is_unread) {
            Some(position) => self.copies.swap_remove(position),
            None => Arc::default(),
        };
        let planes = Arc::get_mut(&mut copy).expect("nobody else holds this copy");
        planes.copy(format, described, pool, slot_offset)?;
        // Copies that the recorder has worked off after a burst go now, with the next key.
        self.copies.retain(|copy| !is_unread(copy));
        self.copies.push(Arc::clone(&copy));
        Ok(copy)
    }
}
