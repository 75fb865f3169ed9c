//! The message that every version can read: why a session does not start.
//!
//! Its layout and the header's never change, so that peers of different major versions can always
//! tell each other, and the user, what they are.

use zerocopy::little_endian::{U16, U32};

use super::Wire;
use super::check::Check;
use crate::error::Result;
use crate::limits::{MAJOR, MINOR};
use crate::message::MessageKind;
use crate::text;

wire_enum! {
    /// Why a session does not start.
    RejectCode {
        /// No major version in common.
        Version = 1 "version",
        /// A required feature that the daemon does not have.
        Feature = 2 "feature",
        /// The client runs as another user.
        User = 3 "user",
        /// As many sessions as the daemon allows.
        Sessions = 4 "sessions",
        /// The first packet was no hello, or a broken one.
        Malformed = 5 "malformed",
        /// No hello in time.
        Timeout = 6 "timeout",
        /// The daemon is stopping.
        Stopping = 7 "stopping",
    }
}

wire_struct! {
    /// See [`Reject`].
    RejectRaw, 240 {
        0 code: U32,
        4 major_min: U16,
        6 major_max: U16,
        8 minor_max: U16,
        10 reserved: U16,
        12 text_length: U32,
        16 text: [u8; 224],
    }
}

/// Why a session does not start.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Reject {
    /// Number of the reason; one that this version does not know reads as None.
    pub code: Option<RejectCode>,
    /// Lowest major version that the daemon speaks.
    pub major_min: u16,
    /// Highest major version that the daemon speaks.
    pub major_max: u16,
    /// Highest minor version of `major_max`.
    pub minor_max: u16,
    /// What was expected and what was found, up to 224 bytes.
    pub text: String,
}

impl Reject {
    /// A refusal by a daemon of this version.
    #[must_use]
    pub fn new(code: RejectCode, text: impl Into<String>) -> Self {
        Self {
            code: Some(code),
            major_min: MAJOR,
            major_max: MAJOR,
            minor_max: MINOR,
            text: text.into(),
        }
    }
}

impl Wire for Reject {
    type Raw = RejectRaw;
    const KIND: MessageKind = MessageKind::Reject;

    fn to_raw(&self) -> RejectRaw {
        let (text_length, text) = text::put(&self.text);
        RejectRaw {
            code: U32::new(self.code.map_or(0, RejectCode::code)),
            major_min: U16::new(self.major_min),
            major_max: U16::new(self.major_max),
            minor_max: U16::new(self.minor_max),
            reserved: U16::ZERO,
            text_length,
            text,
        }
    }

    fn from_raw(raw: &RejectRaw) -> Result<Self> {
        Ok(Self {
            code: RejectCode::from_code(raw.code.get()),
            major_min: raw.major_min.get(),
            major_max: raw.major_max.get(),
            minor_max: raw.minor_max.get(),
            text: text::get(Check(Self::KIND), "text", raw.text_length, &raw.text)?,
        })
    }
}
