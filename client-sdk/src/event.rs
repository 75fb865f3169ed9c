//! What the daemon had to say since the last look.

use foreframe_protocol::{
    EndReason, ErrorMessage, Hint, Pacing, Presented, SlotReleased, Statistics,
};

use crate::client::StreamId;
use crate::output::{OutputFrame, OutputSource};

/// One message of the daemon. An application may ignore all of them.
#[derive(Debug)]
#[non_exhaustive]
pub enum Event {
    /// The daemon has mapped the stream's pool.
    StreamReady(StreamId),
    /// The stream takes no more key frames.
    StreamEnded {
        /// The stream.
        stream: StreamId,
        /// Why.
        reason: EndReason,
    },
    /// A slot is free again.
    SlotReleased(SlotReleased),
    /// A key frame came to the display.
    Presented(Presented),
    /// Counts since the stream started.
    Statistics(Statistics),
    /// How well a submission met the display.
    Pacing(Pacing),
    /// Size and rate that would look best.
    Hint(Hint),
    /// An output frame of a subscription. Its slot is free again when it is dropped.
    Output(OutputFrame),
    /// A subscription has ended.
    OutputEnded {
        /// What was subscribed to.
        source: OutputSource,
        /// Why.
        reason: EndReason,
    },
    /// Something that this client sent was wrong. A fatal one ends the session; one of code
    /// `content` refuses nothing: what the planes hold looks otherwise than declared.
    Refused(ErrorMessage),
}
