//! Output frames for subscribers: the way of key frames, the other way round. The daemon allocates
//! and seals the pool, the subscriber maps it read-only.

use zerocopy::little_endian::{F32, U32, U64};

use super::Wire;
use super::check::Check;
use super::pool::check_shape;
use super::session::EndReason;
use crate::error::Result;
use crate::format::{ColorFormat, Primaries, Transfer};
use crate::limits::{MAX_PHASE_Q12, MAX_SIZE, MAX_SLOTS, MAX_STRIDE, MAX_WHITE_CD_M2, MIN_SLOTS};
use crate::message::MessageKind;

wire_struct! {
    /// See [`Subscribe`].
    SubscribeRaw, 8 {
        0 stream: U32,
        4 slots: U32,
    }
}

wire_struct! {
    /// See [`Unsubscribe`].
    UnsubscribeRaw, 8 {
        0 stream: U32,
        4 reserved: U32,
    }
}

wire_struct! {
    /// See [`OutputPool`].
    OutputPoolRaw, 56 {
        0 stream: U32,
        4 pool: U32,
        8 slots: U32,
        12 width: U32,
        16 height: U32,
        20 stride: U32,
        24 color_format: U32,
        28 transfer: U32,
        32 primaries: U32,
        36 white_cd_m2: F32,
        40 slot_bytes: U64,
        48 reserved: U64,
    }
}

wire_struct! {
    /// See [`OutputFrame`].
    OutputFrameRaw, 64 {
        0 stream: U32,
        4 pool: U32,
        8 slot: U32,
        12 kind: U32,
        16 phase_q12: U32,
        20 reserved: U32,
        24 sequence: U64,
        32 key_index: U64,
        40 content_time_ns: U64,
        48 present_at_ns: U64,
        56 skipped: U64,
    }
}

wire_struct! {
    /// See [`OutputReleased`].
    OutputReleasedRaw, 8 {
        0 pool: U32,
        4 slot: U32,
    }
}

wire_struct! {
    /// See [`OutputEnded`].
    OutputEndedRaw, 8 {
        0 stream: U32,
        4 reason: U32,
    }
}

wire_enum! {
    /// How an output frame came to be.
    OutputKind {
        /// A key frame as it came.
        Real = 1 "real",
        /// An in-between frame.
        Synthesised = 2 "synthesised",
        /// A picture that was shown before.
        Repeated = 3 "repeated",
    }
}

/// The client wants the output frames of a stream.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Subscribe {
    /// The client's number of its own stream, or 0 for whatever the daemon shows.
    pub stream: u32,
    /// Slots of the pool, 1 to 8.
    pub slots: u32,
}

/// The client wants no more output frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Unsubscribe {
    /// As in the subscription.
    pub stream: u32,
}

/// Memory of the output frames to come. The packet carries one file descriptor, as with
/// [`RegisterPool`](crate::RegisterPool). Frames in older pools of the subscription are void.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OutputPool {
    /// As in the subscription.
    pub stream: u32,
    /// Number of the pool, never used twice in a session.
    pub pool: u32,
    /// Slots.
    pub slots: u32,
    /// Columns of every frame in it.
    pub width: u32,
    /// Rows of every frame in it.
    pub height: u32,
    /// Bytes from one row to the next.
    pub stride: u32,
    /// How colour is stored.
    pub color: ColorFormat,
    /// How colour is encoded.
    pub transfer: Transfer,
    /// Chromaticities of colour.
    pub primaries: Primaries,
    /// Luminance of (1, 1, 1) in cd/m2; 0 where it is not stated.
    pub white_cd_m2: f32,
    /// Bytes of one slot, a multiple of 4096. Slot `i` starts at `i * slot_bytes`.
    pub slot_bytes: u64,
}

/// An output frame lies in a slot, complete. The slot stays untouched until it is released.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OutputFrame {
    /// As in the subscription.
    pub stream: u32,
    /// The pool.
    pub pool: u32,
    /// The slot.
    pub slot: u32,
    /// How it came to be.
    pub kind: OutputKind,
    /// Phase in 1/4096, 0 to 16384.
    pub phase_q12: u32,
    /// Counts the output frames of the stream, those that were skipped included.
    pub sequence: u64,
    /// The key frame that it was made from.
    pub key_index: u64,
    /// Simulation time that it shows.
    pub content_time_ns: u64,
    /// Planned start of display.
    pub present_at_ns: u64,
    /// Frames since the subscription that found no free slot.
    pub skipped: u64,
}

/// The slot of an output frame may be written again.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OutputReleased {
    /// The pool.
    pub pool: u32,
    /// The slot.
    pub slot: u32,
}

/// No more output frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OutputEnded {
    /// As in the subscription.
    pub stream: u32,
    /// Why.
    pub reason: EndReason,
}

impl Wire for Subscribe {
    type Raw = SubscribeRaw;
    const KIND: MessageKind = MessageKind::Subscribe;

    fn to_raw(&self) -> SubscribeRaw {
        SubscribeRaw { stream: U32::new(self.stream), slots: U32::new(self.slots) }
    }

    fn from_raw(raw: &SubscribeRaw) -> Result<Self> {
        let slots = raw.slots.get();
        let (min, max) = (u64::from(MIN_SLOTS), u64::from(MAX_SLOTS));
        Check(Self::KIND).range("slots", u64::from(slots), min, max)?;
        Ok(Self { stream: raw.stream.get(), slots })
    }
}

impl Wire for Unsubscribe {
    type Raw = UnsubscribeRaw;
    const KIND: MessageKind = MessageKind::Unsubscribe;

    fn to_raw(&self) -> UnsubscribeRaw {
        UnsubscribeRaw { stream: U32::new(self.stream), reserved: U32::ZERO }
    }

    fn from_raw(raw: &UnsubscribeRaw) -> Result<Self> {
        Check(Self::KIND).zero("reserved", &raw.reserved)?;
        Ok(Self { stream: raw.stream.get() })
    }
}

impl Wire for OutputPool {
    type Raw = OutputPoolRaw;
    const KIND: MessageKind = MessageKind::OutputPool;

    fn to_raw(&self) -> OutputPoolRaw {
        OutputPoolRaw {
            stream: U32::new(self.stream),
            pool: U32::new(self.pool),
            slots: U32::new(self.slots),
            width: U32::new(self.width),
            height: U32::new(self.height),
            stride: U32::new(self.stride),
            color_format: U32::new(self.color.code()),
            transfer: U32::new(self.transfer.code()),
            primaries: U32::new(self.primaries.code()),
            white_cd_m2: F32::new(self.white_cd_m2),
            slot_bytes: U64::new(self.slot_bytes),
            reserved: U64::ZERO,
        }
    }

    fn from_raw(raw: &OutputPoolRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        let (slots, slot_bytes) = (raw.slots.get(), raw.slot_bytes.get());
        check_shape(check, slots, slot_bytes)?;
        let (width, height) = (raw.width.get(), raw.height.get());
        check.range("width", u64::from(width), 1, u64::from(MAX_SIZE))?;
        check.range("height", u64::from(height), 1, u64::from(MAX_SIZE))?;
        let color: ColorFormat = check.coded("color_format", raw.color_format)?;
        let (stride, pixel) = (raw.stride.get(), color.bytes_per_pixel());
        check.range(
            "stride",
            u64::from(stride),
            u64::from(width * pixel),
            u64::from(MAX_STRIDE),
        )?;
        if !stride.is_multiple_of(pixel) {
            return check.fail("stride", format!("a multiple of {pixel}"), stride);
        }
        let bytes = u64::from(stride) * u64::from(height);
        check.range("slot_bytes", slot_bytes, bytes, u64::MAX)?;
        let white_cd_m2 = raw.white_cd_m2.get();
        if !(0.0..=MAX_WHITE_CD_M2).contains(&white_cd_m2) {
            let expected = format!("0 (not stated) to {MAX_WHITE_CD_M2}");
            return check.fail("white_cd_m2", expected, white_cd_m2);
        }
        Ok(Self {
            stream: raw.stream.get(),
            pool: raw.pool.get(),
            slots,
            width,
            height,
            stride,
            color,
            transfer: check.coded("transfer", raw.transfer)?,
            primaries: check.coded("primaries", raw.primaries)?,
            white_cd_m2,
            slot_bytes,
        })
    }
}

impl Wire for OutputFrame {
    type Raw = OutputFrameRaw;
    const KIND: MessageKind = MessageKind::OutputFrame;

    fn to_raw(&self) -> OutputFrameRaw {
        OutputFrameRaw {
            stream: U32::new(self.stream),
            pool: U32::new(self.pool),
            slot: U32::new(self.slot),
            kind: U32::new(self.kind.code()),
            phase_q12: U32::new(self.phase_q12),
            reserved: U32::ZERO,
            sequence: U64::new(self.sequence),
            key_index: U64::new(self.key_index),
            content_time_ns: U64::new(self.content_time_ns),
            present_at_ns: U64::new(self.present_at_ns),
            skipped: U64::new(self.skipped),
        }
    }

    fn from_raw(raw: &OutputFrameRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        check.range("slot", u64::from(raw.slot.get()), 0, u64::from(MAX_SLOTS) - 1)?;
        let phase_q12 = raw.phase_q12.get();
        check.range("phase_q12", u64::from(phase_q12), 0, u64::from(MAX_PHASE_Q12))?;
        Ok(Self {
            stream: raw.stream.get(),
            pool: raw.pool.get(),
            slot: raw.slot.get(),
            kind: check.coded("kind", raw.kind)?,
            phase_q12,
            sequence: raw.sequence.get(),
            key_index: raw.key_index.get(),
            content_time_ns: check.time("content_time_ns", raw.content_time_ns.get())?,
            present_at_ns: check.time("present_at_ns", raw.present_at_ns.get())?,
            skipped: raw.skipped.get(),
        })
    }
}

impl Wire for OutputReleased {
    type Raw = OutputReleasedRaw;
    const KIND: MessageKind = MessageKind::OutputReleased;

    fn to_raw(&self) -> OutputReleasedRaw {
        OutputReleasedRaw { pool: U32::new(self.pool), slot: U32::new(self.slot) }
    }

    fn from_raw(raw: &OutputReleasedRaw) -> Result<Self> {
        let slot = raw.slot.get();
        Check(Self::KIND).range("slot", u64::from(slot), 0, u64::from(MAX_SLOTS) - 1)?;
        Ok(Self { pool: raw.pool.get(), slot })
    }
}

impl Wire for OutputEnded {
    type Raw = OutputEndedRaw;
    const KIND: MessageKind = MessageKind::OutputEnded;

    fn to_raw(&self) -> OutputEndedRaw {
        OutputEndedRaw { stream: U32::new(self.stream), reason: U32::new(self.reason.code()) }
    }

    fn from_raw(raw: &OutputEndedRaw) -> Result<Self> {
        Ok(Self {
            stream: raw.stream.get(),
            reason: Check(Self::KIND).coded("reason", raw.reason)?,
        })
    }
}
