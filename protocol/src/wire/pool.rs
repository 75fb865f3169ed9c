//! Memory of a stream: one sealed pool, cut into slots of equal size.

use zerocopy::little_endian::{U32, U64};

use super::Wire;
use super::check::Check;
use crate::error::Result;
use crate::limits::{MAX_POOL_BYTES, MAX_SLOTS, MIN_SLOTS, SLOT_ALIGN};
use crate::message::MessageKind;

wire_struct! {
    /// See [`RegisterPool`].
    RegisterPoolRaw, 24 {
        0 stream: U32,
        4 pool: U32,
        8 slots: U32,
        12 reserved: U32,
        16 slot_bytes: U64,
    }
}

wire_struct! {
    /// See [`PoolAccepted`].
    PoolAcceptedRaw, 8 {
        0 stream: U32,
        4 pool: U32,
    }
}

/// Memory for the key frames of a stream. The packet carries one file descriptor: a memfd of
/// exactly `slots * slot_bytes` bytes, every page of it written, with all four seals.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RegisterPool {
    /// The stream; each has one pool.
    pub stream: u32,
    /// Number that the client gives it.
    pub pool: u32,
    /// Slots, as many as the stream has.
    pub slots: u32,
    /// Bytes of one slot, a multiple of 4096. Slot `i` starts at `i * slot_bytes`.
    pub slot_bytes: u64,
}

impl RegisterPool {
    /// Bytes of the whole pool.
    #[must_use]
    pub fn pool_bytes(&self) -> u64 {
        self.slot_bytes.saturating_mul(u64::from(self.slots))
    }
}

/// The daemon has mapped the pool.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PoolAccepted {
    /// The stream.
    pub stream: u32,
    /// The client's number of the pool.
    pub pool: u32,
}

/// Checks the shape of a pool: slots, bytes of a slot, bytes of all.
pub(super) fn check_shape(check: Check, slots: u32, slot_bytes: u64) -> Result<()> {
    check.range("slots", u64::from(slots), u64::from(MIN_SLOTS), u64::from(MAX_SLOTS))?;
    check.range("slot_bytes", slot_bytes, SLOT_ALIGN, MAX_POOL_BYTES / u64::from(slots))?;
    if !slot_bytes.is_multiple_of(SLOT_ALIGN) {
        return check.fail("slot_bytes", format!("a multiple of {SLOT_ALIGN}"), slot_bytes);
    }
    Ok(())
}

impl Wire for RegisterPool {
    type Raw = RegisterPoolRaw;
    const KIND: MessageKind = MessageKind::RegisterPool;

    fn to_raw(&self) -> RegisterPoolRaw {
        RegisterPoolRaw {
            stream: U32::new(self.stream),
            pool: U32::new(self.pool),
            slots: U32::new(self.slots),
            reserved: U32::ZERO,
            slot_bytes: U64::new(self.slot_bytes),
        }
    }

    fn from_raw(raw: &RegisterPoolRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        let (slots, slot_bytes) = (raw.slots.get(), raw.slot_bytes.get());
        check_shape(check, slots, slot_bytes)?;
        Ok(Self { stream: raw.stream.get(), pool: raw.pool.get(), slots, slot_bytes })
    }
}

impl Wire for PoolAccepted {
    type Raw = PoolAcceptedRaw;
    const KIND: MessageKind = MessageKind::PoolAccepted;

    fn to_raw(&self) -> PoolAcceptedRaw {
        PoolAcceptedRaw { stream: U32::new(self.stream), pool: U32::new(self.pool) }
    }

    fn from_raw(raw: &PoolAcceptedRaw) -> Result<Self> {
        Ok(Self { stream: raw.stream.get(), pool: raw.pool.get() })
    }
}
