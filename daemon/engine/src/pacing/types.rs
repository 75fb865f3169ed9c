//! What goes into a pacer and what comes out: configuration, plans, counts and status.

use super::budget::WorkEstimate;
use crate::time::{MonoSpan, MonoTime};

/// What a pacer has to know before the first frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PacerConfig {
    /// Announced display period; on a variable display the shortest. The tracked one starts from it
    /// and stays within 1/16 of it, unless it is proven wrong.
    pub refresh_interval: MonoSpan,
    /// Whether the display refreshes on a grid or when it is given a picture.
    pub refresh: RefreshKind,
    /// An instant at which the display refreshes, where it is known beforehand (timer sinks,
    /// replay). Else the first plan sets the grid and the first feedback corrects it.
    pub known_refresh: Option<MonoTime>,
    /// Adds one key interval of delay, for methods that need the key after the content time.
    pub interpolates: bool,
    /// Where the work estimate comes from.
    pub work: WorkEstimate,
}

/// When a display refreshes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum RefreshKind {
    /// On a grid.
    #[default]
    Fixed,
    /// When it is given a picture, but not sooner than one refresh interval after the last.
    Variable,
}

/// The next frame. `wake_at <= wake_by <= submit_by <= present_at` and `submit_from <= submit_by`;
/// none lies before the `now` it was planned at.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Plan {
    /// When to start to make the picture: sooner than it has to be while no key is expected, so
    /// that work that takes longer than usual is still done in time.
    pub wake_at: MonoTime,
    /// When to start at the latest, going by what the work usually takes.
    pub wake_by: MonoTime,
    /// When it may be handed over at the earliest: sooner, and it might be shown a refresh early.
    pub submit_from: MonoTime,
    /// When it has to be handed to the display at the latest, for displays that need it some time
    /// before. One that only counts its refreshes takes a picture until `present_at`.
    pub submit_by: MonoTime,
    /// When the display starts to show it.
    pub present_at: MonoTime,
    /// Which content time it shows, after easing; never before the newest key's unless the method
    /// interpolates. Equal to the newest key's where that key is to be shown as it is. None before
    /// the first key.
    pub content_time: Option<MonoTime>,
}

/// Events since the pacer was made.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct PacerCounts {
    /// Frames shown at their planned refresh.
    pub on_target: u64,
    /// Frames not shown at their planned refresh: shown at another, never shown, or dropped.
    pub missed: u64,
    /// Frames that were not ready in time and were not handed over. Part of `missed`.
    pub dropped: u64,
    /// Steps of the application's clock, forwards or backwards.
    pub clock_steps: u64,
    /// Times that keys fell behind for good and the content clock followed.
    pub relocks: u64,
    /// Presentation timestamps that were off the grid and not followed.
    pub distrusted_timestamps: u64,
}

/// What is known about display and application, as durations: they hold across clock borders.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PacerStatus {
    /// Tracked time from refresh to refresh; the shortest of a variable display.
    pub refresh_interval: MonoSpan,
    /// Usual content time from key to key. None before the second key.
    pub key_interval: Option<MonoSpan>,
    /// How much later keys could have arrived without being shown later, smoothed.
    /// 0 to one refresh interval. None before the first key.
    pub slack: Option<MonoSpan>,
    /// By how much the application should start its frames later (positive) or earlier to meet the
    /// refresh with little slack, within half a refresh interval. None before the first key.
    pub phase_error: Option<MonoSpan>,
    /// Present time minus content time of the newest started frame.
    pub delay: Option<MonoSpan>,
    /// Expected time from wake to an in-between frame being ready.
    pub work: MonoSpan,
    /// The same for a key that is shown as it is.
    pub key_work: MonoSpan,
    /// Time from there to the display's deadline.
    pub margin: MonoSpan,
    /// From that deadline to the refresh: what the display turned out to need, which may be whole
    /// refreshes more than a fraction of one.
    pub display_offset: MonoSpan,
    /// Whether the announced refresh rate proved wrong and a measured one is used.
    pub is_rate_corrected: bool,
    /// Whether the application runs at the refresh rate, so that keys are shown as they are.
    pub keeps_up: bool,
    /// Frames handed over and not heard of yet.
    pub unanswered: usize,
    /// What the display says about frames.
    pub feedback: FeedbackState,
    /// Events so far.
    pub counts: PacerCounts,
}

/// What a display says about the frames that it is given.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum FeedbackState {
    /// It was not asked yet, or its first answers are awaited.
    #[default]
    Awaited,
    /// It tells when it showed them.
    Presented,
    /// It answers nothing. Frames are paced by the announced rate alone.
    Absent,
    /// It throws them away, as it does with a window that nobody sees. A frame is tried now and
    /// then.
    Hidden,
}
