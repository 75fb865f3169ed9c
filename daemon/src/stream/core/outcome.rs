//! What becomes of pictures: of each plan, of each refresh, and by the word of the display.

use foreframe_engine::{MonoSpan, MonoTime, Phase};

/// What became of one plan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameOutcome {
    /// A new picture goes to the display; [`StreamCore`](super::StreamCore) holds it.
    Presented(PresentedFrame),
    /// The display shows the picture before again: there is nothing new to show.
    Repeated,
    /// The picture was not ready for its refresh, which shows the one before again.
    Dropped(DroppedFrame),
}

/// A picture that was made in vain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DroppedFrame {
    /// Real, or made.
    pub kind: FrameKind,
    /// Time that the engine took.
    pub work: MonoSpan,
}

/// A picture that goes to the display.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PresentedFrame {
    /// Number of the output frame, counted up by one per refresh from the first picture on; what
    /// was repeated or dropped leaves a gap.
    pub index: u64,
    /// The newest key that it was made from.
    pub key_index: u64,
    /// Content time of that key.
    pub key_content_time: MonoTime,
    /// Position after that key.
    pub phase: Phase,
    /// Real, or made.
    pub kind: FrameKind,
    /// Content time that it shows.
    pub content_time: MonoTime,
    /// Refresh that it was planned for.
    pub present_at: MonoTime,
    /// Refresh that it is shown at.
    pub presented_at: MonoTime,
    /// Refreshes since the picture before, all of which showed that one again: repeated or dropped.
    pub repeats_before: u64,
    /// Time that the engine took.
    pub work: MonoSpan,
}

/// Where a picture comes from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameKind {
    /// The key itself.
    Real,
    /// Made by the engine.
    Synthesised,
}

/// What became of the refreshes from the first planned picture on. Each is in exactly one of real,
/// synthesised, repeated and dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FrameCounts {
    /// Keys taken in.
    pub keys: u64,
    /// Refreshes that showed a key itself.
    pub real: u64,
    /// Refreshes that showed a made picture.
    pub synthesised: u64,
    /// Refreshes that showed the picture before again because there was nothing new to show, or
    /// nobody had time to plan them.
    pub repeated: u64,
    /// Refreshes that showed the picture before again because theirs was not ready in time.
    pub dropped: u64,
}

/// What a picture that was handed over counts as.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Counted {
    /// A picture of its own.
    New(FrameKind),
    /// The one before again, for a window that has changed.
    Repeated,
}

/// What a display tells.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Told {
    /// The picture planned for `planned` was shown at `presented_at`, which was heard at
    /// `heard_at`.
    Presented {
        /// As planned.
        planned: MonoTime,
        /// As shown.
        presented_at: MonoTime,
        /// When it said so.
        heard_at: MonoTime,
    },
    /// The picture planned for `planned` was never shown.
    Discarded {
        /// As planned.
        planned: MonoTime,
    },
    /// It announces another refresh interval.
    Mode(MonoSpan),
    /// Whether anybody can see it.
    Visible(bool),
    /// What it shows has another size or place, and takes it when a picture is handed over.
    Moved,
}
