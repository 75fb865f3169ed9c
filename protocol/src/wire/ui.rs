//! A user-interface plane by itself, between key frames and at a rate of its own.

use zerocopy::little_endian::{I32, U32, U64};

use super::Wire;
use super::check::Check;
use super::stream::CreateStream;
use super::submit::{PlaneRaw, plane, plane_raw};
use crate::error::Result;
use crate::limits::{MAX_SIZE, MAX_SLOTS};
use crate::message::MessageKind;
use crate::plane::{PlaneDescriptor, PlaneKind, PlaneSize};

wire_struct! {
    /// See [`UiPlane`].
    UiPlaneRaw, 80 {
        0 stream: U32,
        4 slot: U32,
        8 ui_index: U64,
        16 x: I32,
        20 y: I32,
        24 reserved: U64,
        32 plane: PlaneRaw,
    }
}

/// A user interface lies in a slot, complete: it is shown from the next picture on, in the place of
/// the one before.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UiPlane {
    /// The client's number of the stream.
    pub stream: u32,
    /// The slot, 0 to 7: one of the stream's own, as for a key frame.
    pub slot: u32,
    /// Sequence number that the application counts up, apart from that of key frames.
    pub ui_index: u64,
    /// Column and row of the output that the plane's first pixel lies on, within +-8192. What lies
    /// outside the output is not shown.
    pub place: [i32; 2],
    /// Where the plane lies in the slot. Only its valid rectangle is shown; without jitter.
    pub plane: PlaneDescriptor,
}

impl UiPlane {
    /// Checks what needs the stream: that it has UI planes, and that this one fits what was
    /// declared and the slot.
    ///
    /// # Errors
    /// The first fault, with what was expected and found.
    pub fn check(&self, stream: &CreateStream, slot_bytes: u64) -> Result<()> {
        let check = Check(MessageKind::UiPlane);
        let last_slot = u64::from(stream.slots) - 1;
        check.range("slot", u64::from(self.slot), 0, last_slot)?;
        let format = &stream.format;
        let declared = format.bytes_per_pixel(PlaneKind::Ui);
        let (Some(bytes_per_pixel), Some(&max_size)) =
            (declared, stream.max_sizes.get(PlaneKind::Ui))
        else {
            return check.fail("stream", "a stream that declares UI planes", self.stream);
        };
        let color = PlaneSize { width: format.width, height: format.height };
        self.plane.check(PlaneKind::Ui, bytes_per_pixel, max_size, color, slot_bytes)
    }
}

impl Wire for UiPlane {
    type Raw = UiPlaneRaw;
    const KIND: MessageKind = MessageKind::UiPlane;

    fn to_raw(&self) -> UiPlaneRaw {
        let [x, y] = self.place.map(I32::new);
        UiPlaneRaw {
            stream: U32::new(self.stream),
            slot: U32::new(self.slot),
            ui_index: U64::new(self.ui_index),
            x,
            y,
            reserved: U64::ZERO,
            plane: plane_raw(Some(&self.plane)),
        }
    }

    fn from_raw(raw: &UiPlaneRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.range("stream", u64::from(raw.stream.get()), 1, u64::from(u32::MAX))?;
        check.range("slot", u64::from(raw.slot.get()), 0, u64::from(MAX_SLOTS) - 1)?;
        check.zero("reserved", &raw.reserved)?;
        for (field, value) in [("x", raw.x.get()), ("y", raw.y.get())] {
            if value.unsigned_abs() > MAX_SIZE {
                return check.fail(field, format!("within +-{MAX_SIZE}"), value);
            }
        }
        check.zero("plane.jitter", &raw.plane.jitter)?;
        Ok(Self {
            stream: raw.stream.get(),
            slot: raw.slot.get(),
            ui_index: raw.ui_index.get(),
            place: [raw.x.get(), raw.y.get()],
            plane: plane(check, PlaneKind::Ui, &raw.plane)?,
        })
    }
}
