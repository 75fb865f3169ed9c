//! How a session, a stream or a subscription ends.

use zerocopy::little_endian::U32;

use super::Wire;
use super::check::Check;
use crate::error::Result;
use crate::message::MessageKind;

wire_enum! {
    /// Why something ends.
    EndReason {
        /// The client asked for it.
        Requested = 1 "requested",
        /// The daemon is stopping.
        Stopping = 2 "stopping",
        /// An error that was told before.
        Error = 3 "error",
        /// What it depended on has ended.
        SourceEnded = 4 "source_ended",
    }
}

wire_struct! {
    /// See [`Goodbye`].
    GoodbyeRaw, 8 {
        0 reason: U32,
        4 reserved: U32,
    }
}

/// The session ends in good order; nothing follows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Goodbye {
    /// Why.
    pub reason: EndReason,
}

impl Wire for Goodbye {
    type Raw = GoodbyeRaw;
    const KIND: MessageKind = MessageKind::Goodbye;

    fn to_raw(&self) -> GoodbyeRaw {
        GoodbyeRaw { reason: U32::new(self.reason.code()), reserved: U32::ZERO }
    }

    fn from_raw(raw: &GoodbyeRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        Ok(Self { reason: check.coded("reason", raw.reason)? })
    }
}
