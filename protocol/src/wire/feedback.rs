//! What the daemon tells a client about its frames: presented, counts, pacing, hints, errors.

use zerocopy::little_endian::{I64, U32, U64};

use super::Wire;
use super::check::Check;
use crate::error::{Error, Result};
use crate::limits::{MAX_PHASE_Q12, MAX_SIZE};
use crate::message::MessageKind;
use crate::text;

wire_struct! {
    /// See [`Presented`].
    PresentedRaw, 48 {
        0 stream: U32,
        4 phase_q12: U32,
        8 key_index: U64,
        16 content_time_ns: U64,
        24 received_at_ns: U64,
        32 present_at_ns: U64,
        40 presented_at_ns: U64,
    }
}

/// The first picture made from a key frame came to the display.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Presented {
    /// The client's number of the stream.
    pub stream: u32,
    /// Phase of that picture in 1/4096, 0 to 16384.
    pub phase_q12: u32,
    /// The key frame.
    pub key_index: u64,
    /// Content time of that picture.
    pub content_time_ns: u64,
    /// Arrival of the key frame at the daemon.
    pub received_at_ns: u64,
    /// Planned start of display.
    pub present_at_ns: u64,
    /// Start of display as the sink reports it.
    pub presented_at_ns: u64,
}

impl Wire for Presented {
    type Raw = PresentedRaw;
    const KIND: MessageKind = MessageKind::Presented;

    fn to_raw(&self) -> PresentedRaw {
        PresentedRaw {
            stream: U32::new(self.stream),
            phase_q12: U32::new(self.phase_q12),
            key_index: U64::new(self.key_index),
            content_time_ns: U64::new(self.content_time_ns),
            received_at_ns: U64::new(self.received_at_ns),
            present_at_ns: U64::new(self.present_at_ns),
            presented_at_ns: U64::new(self.presented_at_ns),
        }
    }

    fn from_raw(raw: &PresentedRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        let phase_q12 = raw.phase_q12.get();
        check.range("phase_q12", u64::from(phase_q12), 0, u64::from(MAX_PHASE_Q12))?;
        Ok(Self {
            stream: raw.stream.get(),
            phase_q12,
            key_index: raw.key_index.get(),
            content_time_ns: check.time("content_time_ns", raw.content_time_ns.get())?,
            received_at_ns: check.time("received_at_ns", raw.received_at_ns.get())?,
            present_at_ns: check.time("present_at_ns", raw.present_at_ns.get())?,
            presented_at_ns: check.time("presented_at_ns", raw.presented_at_ns.get())?,
        })
    }
}

wire_struct! {
    /// See [`Statistics`].
    StatisticsRaw, 80 {
        0 stream: U32,
        4 reserved: U32,
        8 keys_received: U64,
        16 keys_superseded: U64,
        24 keys_refused: U64,
        32 presented: U64,
        40 real: U64,
        48 synthesised: U64,
        56 repeated: U64,
        64 dropped: U64,
        72 synthesis_mean_ns: U64,
    }
}

/// Counts since the stream started.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Statistics {
    /// The client's number of the stream.
    pub stream: u32,
    /// Key frames that arrived.
    pub keys_received: u64,
    /// Of these, replaced by a newer one before a picture of them was handed to the
    /// display, before or after they were latched.
    pub keys_superseded: u64,
    /// Of these, with planes that do not fit the stream.
    pub keys_refused: u64,
    /// Refreshes that showed what they should: real + synthesised + repeated. From the first
    /// planned picture on, each refresh is in exactly one of these three or in `dropped`.
    pub presented: u64,
    /// Of these, key frames as they came.
    pub real: u64,
    /// Of these, in-between frames.
    pub synthesised: u64,
    /// Of these, the picture before again: there was nothing new to show.
    pub repeated: u64,
    /// Refreshes that showed the picture before again because theirs was not ready.
    pub dropped: u64,
    /// Mean time to make one in-between frame, dropped ones included.
    pub synthesis_mean_ns: u64,
}

impl Wire for Statistics {
    type Raw = StatisticsRaw;
    const KIND: MessageKind = MessageKind::Statistics;

    fn to_raw(&self) -> StatisticsRaw {
        StatisticsRaw {
            stream: U32::new(self.stream),
            reserved: U32::ZERO,
            keys_received: U64::new(self.keys_received),
            keys_superseded: U64::new(self.keys_superseded),
            keys_refused: U64::new(self.keys_refused),
            presented: U64::new(self.presented),
            real: U64::new(self.real),
            synthesised: U64::new(self.synthesised),
            repeated: U64::new(self.repeated),
            dropped: U64::new(self.dropped),
            synthesis_mean_ns: U64::new(self.synthesis_mean_ns),
        }
    }

    fn from_raw(raw: &StatisticsRaw) -> Result<Self> {
        Check(Self::KIND).zero("reserved", &raw.reserved)?;
        Ok(Self {
            stream: raw.stream.get(),
            keys_received: raw.keys_received.get(),
            keys_superseded: raw.keys_superseded.get(),
            keys_refused: raw.keys_refused.get(),
            presented: raw.presented.get(),
            real: raw.real.get(),
            synthesised: raw.synthesised.get(),
            repeated: raw.repeated.get(),
            dropped: raw.dropped.get(),
            synthesis_mean_ns: raw.synthesis_mean_ns.get(),
        })
    }
}

wire_struct! {
    /// See [`Pacing`].
    PacingRaw, 40 {
        0 stream: U32,
        4 reserved: U32,
        8 key_index: U64,
        16 refresh_interval_ns: U64,
        24 slack_ns: I64,
        32 phase_error_ns: I64,
    }
}

/// How well submissions meet the display, as of the newest. Durations only, so that no clock has to
/// be shared.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pacing {
    /// The client's number of the stream.
    pub stream: u32,
    /// The key frame that this is about.
    pub key_index: u64,
    /// Time between two refreshes of the display.
    pub refresh_interval_ns: u64,
    /// How much later key frames could arrive without being shown later, smoothed; 0 to one refresh
    /// interval.
    pub slack_ns: i64,
    /// How much later the application should start its frames to be shown soonest after they
    /// arrive; negative: earlier. At most half a refresh interval. Following a sixteenth of it a
    /// frame is stable.
    pub phase_error_ns: i64,
}

impl Wire for Pacing {
    type Raw = PacingRaw;
    const KIND: MessageKind = MessageKind::Pacing;

    fn to_raw(&self) -> PacingRaw {
        PacingRaw {
            stream: U32::new(self.stream),
            reserved: U32::ZERO,
            key_index: U64::new(self.key_index),
            refresh_interval_ns: U64::new(self.refresh_interval_ns),
            slack_ns: I64::new(self.slack_ns),
            phase_error_ns: I64::new(self.phase_error_ns),
        }
    }

    fn from_raw(raw: &PacingRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        Ok(Self {
            stream: raw.stream.get(),
            key_index: raw.key_index.get(),
            refresh_interval_ns: check
                .time("refresh_interval_ns", raw.refresh_interval_ns.get())?,
            slack_ns: raw.slack_ns.get(),
            phase_error_ns: raw.phase_error_ns.get(),
        })
    }
}

wire_struct! {
    /// See [`Hint`].
    HintRaw, 24 {
        0 stream: U32,
        4 width: U32,
        8 height: U32,
        12 reserved: U32,
        16 key_interval_ns: U64,
    }
}

/// Size and rate of key frames that would look best for what they cost.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Hint {
    /// The client's number of the stream.
    pub stream: u32,
    /// Columns of colour's valid rectangle, 1 to 8192.
    pub width: u32,
    /// Rows of colour's valid rectangle, 1 to 8192.
    pub height: u32,
    /// Time from one key frame to the next.
    pub key_interval_ns: u64,
}

impl Wire for Hint {
    type Raw = HintRaw;
    const KIND: MessageKind = MessageKind::Hint;

    fn to_raw(&self) -> HintRaw {
        HintRaw {
            stream: U32::new(self.stream),
            width: U32::new(self.width),
            height: U32::new(self.height),
            reserved: U32::ZERO,
            key_interval_ns: U64::new(self.key_interval_ns),
        }
    }

    fn from_raw(raw: &HintRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        check.range("width", u64::from(raw.width.get()), 1, u64::from(MAX_SIZE))?;
        check.range("height", u64::from(raw.height.get()), 1, u64::from(MAX_SIZE))?;
        Ok(Self {
            stream: raw.stream.get(),
            width: raw.width.get(),
            height: raw.height.get(),
            key_interval_ns: check.time("key_interval_ns", raw.key_interval_ns.get())?,
        })
    }
}

wire_enum! {
    /// What kind of thing was wrong.
    ErrorCode {
        /// A packet or a field of a message.
        Message = 1 "message",
        /// A message at a time that does not allow it.
        State = 2 "state",
        /// A stream, slot, pool or subscription that does not exist.
        Unknown = 3 "unknown",
        /// A plane of a key frame.
        Plane = 4 "plane",
        /// Shared memory that is not safe to read.
        Memory = 5 "memory",
        /// More than the daemon grants.
        Quota = 6 "quota",
        /// Something that this daemon cannot do.
        Unsupported = 7 "unsupported",
        /// Content times or key indices that do not increase.
        Order = 8 "order",
        /// The daemon's own fault.
        Internal = 9 "internal",
        /// What a plane holds looks like something else than the stream declares. It is taken as
        /// declared, and nothing is refused.
        Content = 10 "content",
    }
}

wire_struct! {
    /// See [`ErrorMessage`].
    ErrorRaw, 528 {
        0 code: U32,
        4 is_fatal: U32,
        8 stream: U32,
        12 field_length: U32,
        16 expected_length: U32,
        20 found_length: U32,
        24 reserved: U64,
        32 field: [u8; 48],
        80 expected: [u8; 224],
        304 found: [u8; 224],
    }
}

/// Something that the client sent was wrong.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ErrorMessage {
    /// What kind of thing.
    pub code: ErrorCode,
    /// Whether the session ends with it.
    pub is_fatal: bool,
    /// The stream that it is about, if it is about one.
    pub stream: Option<u32>,
    /// The part that was wrong, up to 48 bytes.
    pub field: String,
    /// What it should have been, up to 224 bytes.
    pub expected: String,
    /// What it was, up to 224 bytes.
    pub found: String,
}

impl ErrorMessage {
    /// Tells a peer about an error that its message caused.
    #[must_use]
    pub fn new(error: &Error, is_fatal: bool, stream: Option<u32>) -> Self {
        let code = match error {
            Error::Packet { .. } | Error::Field { .. } | Error::Version { .. } => {
                ErrorCode::Message
            }
            Error::Plane { .. } => ErrorCode::Plane,
            Error::Slot { .. } => ErrorCode::State,
            Error::Order { .. } => ErrorCode::Order,
            Error::Memory { .. } => ErrorCode::Memory,
            _ => ErrorCode::Internal,
        };
        let (field, expected, found) = error.parts();
        Self { code, is_fatal, stream, field, expected, found }
    }
}

impl Wire for ErrorMessage {
    type Raw = ErrorRaw;
    const KIND: MessageKind = MessageKind::Error;

    fn to_raw(&self) -> ErrorRaw {
        let (field_length, field) = text::put(&self.field);
        let (expected_length, expected) = text::put(&self.expected);
        let (found_length, found) = text::put(&self.found);
        ErrorRaw {
            code: U32::new(self.code.code()),
            is_fatal: U32::new(u32::from(self.is_fatal)),
            stream: U32::new(self.stream.unwrap_or(0)),
            field_length,
            expected_length,
            found_length,
            reserved: U64::ZERO,
            field,
            expected,
            found,
        }
    }

    fn from_raw(raw: &ErrorRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        check.range("is_fatal", u64::from(raw.is_fatal.get()), 0, 1)?;
        Ok(Self {
            code: check.coded("code", raw.code)?,
            is_fatal: raw.is_fatal != 0,
            stream: Some(raw.stream.get()).filter(|&stream| stream != 0),
            field: text::get(check, "field", raw.field_length, &raw.field)?,
            expected: text::get(check, "expected", raw.expected_length, &raw.expected)?,
            found: text::get(check, "found", raw.found_length, &raw.found)?,
        })
    }
}
