//! Streams: one thread each, from key frames in shared memory to pictures at the display's pace.
//!
//! The main loop [`start`](thread::start)s a stream, puts checked submissions into its [`mailbox`],
//! and hears of everything else through [`StreamEvent`]s. The [`thread`] copies planes out of the
//! pool ([`planes`]), drives the [`core`], and hands pictures to subscribers ([`outlet`]), to a
//! sink, to the window ([`display`]) and key frames to the recorder. What it is told to do
//! differently is a [`command`], what it notices about itself is [`observed`]. A picture that no key
//! can wait for longer is [`owed`]. Threads ask for [`real_time`] priority. Whatever is slow to drop goes to the [`reaper`], and pools for
//! subscribers come from the [`allocator`].

pub mod allocator;
pub mod command;
pub mod core;
mod display;
pub mod hints;
mod intake;
pub mod mailbox;
pub mod observed;
pub mod outlet;
pub mod owed;
pub mod planes;
pub mod real_time;
pub mod reaper;
pub mod thread;

use crate::control::StreamStatus;
use foreframe_protocol::slots::SlotUse;
use foreframe_protocol::{ErrorMessage, Hint, OutputFrame, Pacing, Presented, Statistics};

/// What a stream's thread tells the main loop, in order.
#[derive(Clone, PartialEq, Debug)]
pub enum StreamEvent {
    /// The planes of a key frame, or a UI plane, are copied.
    SlotCopied(SlotUse),
    /// A key frame or UI plane does not fit its stream. The message has everything but the stream's
    /// number.
    KeyRefused(ErrorMessage),
    /// What its keys hold looks like something else than the stream declares. Lacks the stream's
    /// number.
    Noticed(ErrorMessage),
    /// A key frame came to the display. Lacks the stream's number.
    Presented(Presented),
    /// Counts. Lacks the stream's number.
    Statistics(Statistics),
    /// How a key frame met the display. Lacks the stream's number.
    Pacing(Pacing),
    /// Size and rate that would look best. Lacks the stream's number.
    Hint(Hint),
    /// What people want to know. Lacks what the main loop knows.
    Report(Box<StreamStatus>),
    /// A frame lies in a slot of an output pool of this session.
    Output(u32, OutputFrame),
    /// The thread has ended, and this is its last event.
    Ended {
        /// Because of a bug in it.
        has_panicked: bool,
    },
}

/// An event and the stream that it comes from, by its number in this process.
#[derive(Clone, PartialEq, Debug)]
pub struct FromStream {
    /// The stream.
    pub ordinal: u64,
    /// The event.
    pub event: StreamEvent,
}
