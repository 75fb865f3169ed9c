//! The simulated display: a drifting grid of refreshes, some of which it skips, that shows the
//! newest frame handed over in time, and feedback that comes late, noisy or not at all.

use super::rng::SplitMix64;
use crate::time::{MonoSpan, MonoTime};

/// A frame must be handed over this long before the refresh that shows it.
const LATCH: MonoSpan = MonoSpan::from_us(100);
/// Where the first refresh lies: on no round number, so that nothing starts aligned by luck.
const FIRST_REFRESH: MonoSpan = MonoSpan::from_ns(3_141_593);

/// What the display does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DisplayScript {
    /// The period that it announces.
    pub refresh_interval: MonoSpan,
    /// By how much its period really is longer, in millionths.
    pub drift_ppm: i32,
    /// Refreshes at which it shows the previous picture again, whatever is handed over.
    pub skipped_per_mille: u32,
    /// Error of the reported instants, +-.
    pub timestamp_jitter: MonoSpan,
    /// Time from a refresh until its feedback arrives.
    pub feedback_delay: MonoSpan,
    /// Feedback arrives up to this much later still, so that it may come out of order.
    pub feedback_jitter: MonoSpan,
    /// Feedback that never arrives.
    pub feedback_lost_per_mille: u32,
}

impl DisplayScript {
    /// A display that announces `refresh_interval`, keeps it, and tells the truth at once.
    #[must_use]
    pub fn steady(refresh_interval: MonoSpan) -> Self {
        Self {
            refresh_interval,
            drift_ppm: 0,
            skipped_per_mille: 0,
            timestamp_jitter: MonoSpan::ZERO,
            feedback_delay: MonoSpan::ZERO,
            feedback_jitter: MonoSpan::ZERO,
            feedback_lost_per_mille: 0,
        }
    }
}

/// What feedback about a refresh says, and when.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Feedback {
    pub(super) arrives_at: MonoTime,
    pub(super) presented_at: MonoTime,
}

/// The display.
#[derive(Clone, Debug)]
pub(super) struct SimDisplay {
    script: DisplayScript,
    seed: u64,
    origin: MonoTime,
}

impl SimDisplay {
    pub(super) fn new(script: DisplayScript, seed: u64, start: MonoTime) -> Self {
        Self { script, seed, origin: start + FIRST_REFRESH }
    }

    /// True period, to the nanosecond.
    pub(super) fn interval(&self) -> MonoSpan {
        self.refresh_at(1) - self.refresh_at(0)
    }

    /// True instant of refresh `index`.
    pub(super) fn refresh_at(&self, index: i64) -> MonoTime {
        // In parts per million, so that the drift of one interval is not rounded away.
        let parts = 1_000_000 + i64::from(self.script.drift_ppm);
        let span = self.script.refresh_interval.scale(index, 1).scale(parts, 1_000_000);
        self.origin + span
    }

    /// The refresh that shows a frame handed over at `submitted_at`.
    pub(super) fn shows_at(&self, submitted_at: MonoTime) -> i64 {
        let ready = submitted_at + LATCH;
        let nominal = self.script.refresh_interval.as_ns().max(1);
        // Drift moves the grid by whole refreshes over a long run: start low, then walk.
        let elapsed = (ready - self.origin).as_ns();
        let mut index = elapsed.div_euclid(nominal) - elapsed / nominal / 500 - 2;
        while self.refresh_at(index) < ready || self.is_skipped(index) {
            index += 1;
        }
        index
    }

    /// Feedback about a frame shown at refresh `index`; None if it gets lost.
    pub(super) fn feedback(&self, index: i64) -> Option<Feedback> {
        let mut chance = self.chance(index, 1);
        if chance.happens(self.script.feedback_lost_per_mille) {
            return None;
        }
        let refresh = self.refresh_at(index);
        let presented_at = refresh + chance.within(self.script.timestamp_jitter);
        let half = self.script.feedback_jitter.scale(1, 2);
        let delay = self.script.feedback_delay + half + chance.within(half);
        Some(Feedback { arrives_at: refresh + delay, presented_at })
    }

    fn is_skipped(&self, index: i64) -> bool {
        self.chance(index, 0).happens(self.script.skipped_per_mille)
    }

    /// Chance that belongs to one refresh, so that asking twice gives one answer.
    fn chance(&self, index: i64, purpose: u64) -> SplitMix64 {
        let mut of_index = SplitMix64::new(self.seed ^ (index.cast_unsigned() << 1) ^ purpose);
        SplitMix64::new(of_index.next_bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn display(script: DisplayScript) -> SimDisplay {
        SimDisplay::new(script, 5, MonoTime::from_ns(1_000_000_000))
    }

    #[test]
    fn a_frame_is_shown_at_the_first_refresh_that_can_still_latch_it() {
        let mut script = DisplayScript::steady(MonoSpan::from_hz(120.0));
        script.drift_ppm = 200;
        let display = display(script);
        for index in [0, 1, 999, 1_000_000] {
            let latest = display.refresh_at(index) - LATCH;
            assert_eq!(display.shows_at(latest), index);
            assert_eq!(display.shows_at(latest + MonoSpan::from_ns(1)), index + 1);
        }
        let elapsed = display.refresh_at(1_000_000) - display.refresh_at(0);
        assert_eq!(elapsed.as_ns(), 8_333_333_i64 * 1_000_200);
    }

    #[test]
    fn skipped_refreshes_show_nothing_new_and_lost_feedback_never_comes() {
        let mut script = DisplayScript::steady(MonoSpan::from_hz(60.0));
        script.skipped_per_mille = 100;
        script.feedback_lost_per_mille = 100;
        let display = display(script);
        let skipped = (0..1_000)
            .filter(|&index| display.shows_at(display.refresh_at(index) - LATCH) != index);
        let (skipped, lost) = (
            skipped.count(),
            (0..1_000).filter(|&index| display.feedback(index).is_none()).count(),
        );
        assert!((60..140).contains(&skipped), "{skipped} of 1000 skipped");
        assert!((60..140).contains(&lost), "{lost} of 1000 lost");
    }
}
