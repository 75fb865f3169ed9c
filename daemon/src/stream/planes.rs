//! Private copies of the planes of a key, made once, read by engine and recorder alike.

use std::sync::Arc;

use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::{Error, PlaneKind, PlaneMap, StreamFormat, Submit};

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
        submit: &Submit,
        pool: &ReadOnlyPool,
        slot_offset: u64,
    ) -> Result<(), Error> {
        self.present = 0;
        for (kind, plane) in submit.planes.iter() {
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
        submit: &Submit,
        pool: &ReadOnlyPool,
        slot_offset: u64,
    ) -> Result<Arc<KeyPlanes>, Error> {
        let is_unread = |copy: &Arc<KeyPlanes>| Arc::strong_count(copy) == 1;
        let mut copy = match self.copies.iter().position(is_unread) {
            Some(position) => self.copies.swap_remove(position),
            None => Arc::default(),
        };
        let planes = Arc::get_mut(&mut copy).expect("nobody else holds this copy");
        planes.copy(format, submit, pool, slot_offset)?;
        // Copies that the recorder has worked off after a burst go now, with the next key.
        self.copies.retain(|copy| !is_unread(copy));
        self.copies.push(Arc::clone(&copy));
        Ok(copy)
    }
}
