//! How long before a refresh a display has to have a frame.
//!
//! Every frame that was handed over before its refresh is evidence: with this lead it was shown in
//! time, or a refresh late. The deadline is the lead that separates the two with the fewest frames
//! on the wrong side. Where refreshes are missed for other reasons the late ones are spread over
//! all leads, no lead separates them, and the deadline stays what it was. Misses widen the margin,
//! so leads vary by themselves as long as there are misses.
//!
//! The deadline comes down slowly, so that a display which was busy for a while is tried again. It
//! may start from a guess: a display that is always late looks like one that is never early enough.

use std::collections::VecDeque;

use crate::time::MonoSpan;

/// Frames that the deadline rests on.
const WINDOW: usize = 64;
/// A lead has to explain so many late frames more than the deadline before.
const LEAST_EXPLAINED: i64 = 2;
/// Frames in time with a larger lead that it takes to believe in a deadline: where none is in time,
/// the display needs a whole refresh more.
const LEAST_IN_TIME: usize = 4;
/// Times that frames with a smaller lead begin to be late that it takes: when a display shows
/// nothing for a while, leads have just been falling, and any of them would separate that from what
/// was before.
const LEAST_EPISODES: usize = 2;
/// Added to the lead of a late frame. With half of it, it comes down to late frames twice as often.
const STEP: MonoSpan = MonoSpan::from_us(500);
/// Each frame in time takes 1 / this off: 1 ms of 4 in 20 s at 120 Hz.
const DECAY_DIVISOR: i64 = 8_192;
/// The deadline is at most this share of a refresh interval, in percent: earlier, and a frame could
/// be taken for the refresh before.
const MOST_PERCENT: i64 = 70;

/// The deadline of a display.
#[derive(Clone, Debug, Default)]
pub(super) struct Deadline {
    /// Lead of each frame before its refresh, and whether it was late. Newest last.
    frames: VecDeque<(MonoSpan, bool)>,
    before_refresh: MonoSpan,
}

impl Deadline {
    /// Believed until the display shows otherwise.
    pub(super) fn starting_at(before_refresh: MonoSpan) -> Self {
        Self { before_refresh: before_refresh.max(MonoSpan::ZERO), ..Self::default() }
    }

    /// Time before the refresh; zero until a display turns out to need some.
    pub(super) fn before_refresh(&self) -> MonoSpan {
        self.before_refresh
    }

    /// A frame that was handed over `lead` before its refresh was shown at it, or after it.
    pub(super) fn on_frame(&mut self, lead: MonoSpan, was_late: bool, interval: MonoSpan) {
        if self.frames.len() == WINDOW {
            self.frames.pop_front();
        }
        self.frames.push_back((lead, was_late));
        self.before_refresh -= self.before_refresh.scale(1, DECAY_DIVISOR);
        if !was_late {
            return;
        }
        let most = interval.scale(MOST_PERCENT, 100);
        let candidates = self.frames.iter().filter(|&&(lead, was_late)| was_late && lead < most);
        let candidates = candidates.map(|&(lead, _)| lead + MonoSpan::from_ns(1));
        let helps = |&deadline: &MonoSpan| {
            self.in_time_above(deadline) >= LEAST_IN_TIME
                && self.late_episodes_below(deadline) >= LEAST_EPISODES
        };
        let best = candidates.filter(helps).map(|lead| (self.wrong(lead), lead)).min();
        if let Some((wrong, lead)) = best
            && wrong + LEAST_EXPLAINED <= self.wrong(self.before_refresh)
            && lead > self.before_refresh
        {
            self.before_refresh = (lead + STEP).min(most);
        }
    }

    /// No frame is ever shown sooner than `needed` after it was handed over.
    pub(super) fn move_up_to(&mut self, needed: MonoSpan, interval: MonoSpan) {
        let most = interval.scale(MOST_PERCENT, 100);
        self.before_refresh = (needed + STEP).min(most).max(self.before_refresh);
        self.frames.clear();
    }

    /// Frames in time that met a deadline.
    fn in_time_above(&self, deadline: MonoSpan) -> usize {
        let is_one = |&&(lead, was_late): &&(MonoSpan, bool)| !was_late && lead >= deadline;
        self.frames.iter().filter(is_one).count()
    }

    /// How often frames that missed a deadline began to be late.
    fn late_episodes_below(&self, deadline: MonoSpan) -> usize {
        let is_late = |&(lead, was_late): &(MonoSpan, bool)| was_late && lead < deadline;
        let pairs = self.frames.iter().zip(self.frames.iter().skip(1));
        pairs.filter(|(before, after)| !before.1 && is_late(after)).count()
    }

    /// Frames that a deadline would put on the wrong side.
    fn wrong(&self, deadline: MonoSpan) -> i64 {
        let is_wrong = |&&(lead, was_late): &&(MonoSpan, bool)| was_late != (lead < deadline);
        self.frames.iter().filter(is_wrong).count().try_into().unwrap_or(i64::MAX)
    }

    pub(super) fn verify_invariants(&self) {
        assert!(self.frames.len() <= WINDOW, "window overflow: {}", self.frames.len());
        assert!(self.before_refresh >= MonoSpan::ZERO, "deadline after the refresh: {self:?}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL: MonoSpan = MonoSpan::from_ms(8);

    fn fed(frames: impl IntoIterator<Item = (i64, bool)>) -> Deadline {
        let mut deadline = Deadline::default();
        for (lead_us, was_late) in frames {
            deadline.on_frame(MonoSpan::from_us(lead_us), was_late, INTERVAL);
            deadline.verify_invariants();
        }
        deadline
    }

    #[test]
    fn the_lead_that_separates_late_frames_from_others_is_the_deadline() {
        // 4 ms are needed; leads go from 1 to 6 ms.
        let found = fed((0..200).map(|n| 1_000 + (n * 37) % 50 * 100).map(|us| (us, us < 4_000)));
        let found = found.before_refresh();
        let range = MonoSpan::from_us(3_900)..=MonoSpan::from_us(4_500);
        assert!(range.contains(&found), "{found:?}");
    }

    #[test]
    fn misses_whatever_the_lead_are_no_deadline() {
        let found = fed((0..2_000).map(|n| (1_000 + (n * 37) % 50 * 100, n % 20 == 3)));
        assert!(found.before_refresh() < MonoSpan::from_us(1_300), "{found:?}");
        assert_eq!(fed([(500, true)]).before_refresh(), MonoSpan::ZERO, "one miss is none");
    }

    #[test]
    fn it_never_reaches_into_the_refresh_before() {
        let found = fed((0..400).map(|n| 1_000 + (n * 37) % 70 * 100).map(|us| (us, us < 7_000)));
        let most = INTERVAL.scale(MOST_PERCENT, 100);
        assert!(found.before_refresh() <= most, "{found:?}");
        let never = fed((0..200).map(|n| (1_000 + n * 30, true)));
        assert_eq!(never.before_refresh(), MonoSpan::ZERO, "no lead helps");
    }
}
