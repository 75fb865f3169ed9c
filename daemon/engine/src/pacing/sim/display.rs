//! The simulated display: a drifting grid of refreshes, some of which it skips, or none at all,
//! that shows the newest frame handed over in time, and feedback that comes late, noisy, wrong or
//! never.

use super::rng::SplitMix64;
use crate::pacing::RefreshKind;
use crate::time::{MonoSpan, MonoTime};

/// A frame must be handed over this long before the refresh that shows it, as a rule.
const LATCH: MonoSpan = MonoSpan::from_us(100);
/// Where the first refresh lies: on no round number, so that nothing starts aligned by luck.
const FIRST_REFRESH: MonoSpan = MonoSpan::from_ns(3_141_593);

/// What the display does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DisplayScript {
    /// The period that it announces; of a variable display the shortest.
    pub refresh_interval: MonoSpan,
    /// The period that it really has, where it lies.
    pub true_interval: Option<MonoSpan>,
    /// Whether it has a grid.
    pub kind: RefreshKind,
    /// By how much its period really is longer, in millionths.
    pub drift_ppm: i32,
    /// Refreshes at which it shows the previous picture again, whatever is handed over.
    pub skipped_per_mille: u32,
    /// Times at which it does so refresh after refresh.
    pub burst: Option<MissBurst>,
    /// How long before a refresh it takes the frame that it shows then.
    pub latch: MonoSpan,
    /// Refreshes that it needs from the one that takes a frame to the one that shows it.
    pub depth: u8,
    /// Error of the reported instants, +-.
    pub timestamp_jitter: MonoSpan,
    /// Reported instants that are off by up to half an interval.
    pub wrong_per_mille: u32,
    /// Time from a refresh until its feedback arrives.
    pub feedback_delay: MonoSpan,
    /// Feedback arrives up to this much later still, so that it may come out of order.
    pub feedback_jitter: MonoSpan,
    /// Feedback that never arrives.
    pub feedback_lost_per_mille: u32,
}

/// The display shows nothing new, again and again.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MissBurst {
    /// From the beginning of one burst to that of the next. The first is at half of it.
    pub every: MonoSpan,
    /// How long each lasts.
    pub length: MonoSpan,
}

impl DisplayScript {
    /// A display that announces `refresh_interval`, keeps it, and tells the truth at once.
    #[must_use]
    pub fn steady(refresh_interval: MonoSpan) -> Self {
        Self {
            refresh_interval,
            true_interval: None,
            kind: RefreshKind::Fixed,
            drift_ppm: 0,
            skipped_per_mille: 0,
            burst: None,
            latch: LATCH,
            depth: 0,
            timestamp_jitter: MonoSpan::ZERO,
            wrong_per_mille: 0,
            feedback_delay: MonoSpan::ZERO,
            feedback_jitter: MonoSpan::ZERO,
            feedback_lost_per_mille: 0,
        }
    }
}

/// When a picture is shown. Of two pictures for one slot, the display shows the newer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Slot {
    /// Number of the refresh; on a variable display of the picture.
    pub(super) index: i64,
    /// True instant.
    pub(super) at: MonoTime,
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
    /// The newest picture shown, which a variable display counts from.
    last: Option<Slot>,
}

impl SimDisplay {
    pub(super) fn new(script: DisplayScript, seed: u64, start: MonoTime) -> Self {
        Self { script, seed, origin: start + FIRST_REFRESH, last: None }
    }

    /// True period, to the nanosecond.
    pub(super) fn interval(&self) -> MonoSpan {
        self.refresh_at(1) - self.refresh_at(0)
    }

    pub(super) fn kind(&self) -> RefreshKind {
        self.script.kind
    }

    /// The slot of a frame handed over at `submitted_at`.
    pub(super) fn slot(&self, submitted_at: MonoTime) -> Slot {
        match self.script.kind {
            RefreshKind::Fixed => {
                let index = self.taken_at(submitted_at) + i64::from(self.script.depth);
                Slot { index, at: self.refresh_at(index) }
            }
            RefreshKind::Variable => {
                let ready = submitted_at + self.script.latch;
                let free = |last: Slot| last.at + self.interval();
                let at = self.last.map_or(ready, |last| ready.max(free(last)));
                Slot { index: self.last.map_or(0, |last| last.index + 1), at }
            }
        }
    }

    /// A picture is shown in `slot`.
    pub(super) fn show(&mut self, slot: Slot) {
        self.last = Some(slot);
    }

    /// Feedback about the frame shown in `slot`; None if it gets lost.
    pub(super) fn feedback(&self, slot: Slot) -> Option<Feedback> {
        let mut chance = self.chance(slot.index, 1);
        if chance.happens(self.script.feedback_lost_per_mille) {
            return None;
        }
        let mut presented_at = slot.at + chance.within(self.script.timestamp_jitter);
        let half = self.script.feedback_jitter.scale(1, 2);
        let delay = self.script.feedback_delay + half + chance.within(half);
        if chance.happens(self.script.wrong_per_mille) {
            presented_at = slot.at + chance.within(self.interval().scale(1, 2));
        }
        Some(Feedback { arrives_at: slot.at + delay, presented_at })
    }

    /// Whether it tells of the frame that was thrown away for the one in `slot`.
    pub(super) fn tells_of_discard(&self, slot: Slot) -> bool {
        !self.chance(slot.index, 2).happens(self.script.feedback_lost_per_mille)
    }

    /// True instant of refresh `index`.
    fn refresh_at(&self, index: i64) -> MonoTime {
        // In parts per million, so that the drift of one interval is not rounded away.
        let parts = 1_000_000 + i64::from(self.script.drift_ppm);
        let interval = self.script.true_interval.unwrap_or(self.script.refresh_interval);
        self.origin + interval.scale(index, 1).scale(parts, 1_000_000)
    }

    /// The refresh that takes a frame handed over at `submitted_at`.
    fn taken_at(&self, submitted_at: MonoTime) -> i64 {
        let ready = submitted_at + self.script.latch;
        let interval = self.script.true_interval.unwrap_or(self.script.refresh_interval);
        let nominal = interval.as_ns().max(1);
        // Drift moves the grid by whole refreshes over a long run: start low, then walk.
        let elapsed = (ready - self.origin).as_ns();
        let mut index = elapsed.div_euclid(nominal) - elapsed / nominal / 500 - 2;
        while self.refresh_at(index) < ready || self.is_skipped(index) {
            index += 1;
        }
        index
    }

    fn is_skipped(&self, index: i64) -> bool {
        let is_in_burst = self.script.burst.is_some_and(|burst| {
            let every = burst.every.as_ns().max(1);
            let into =
                ((self.refresh_at(index) - self.origin).as_ns() - every / 2).rem_euclid(every);
            MonoSpan::from_ns(into) < burst.length.min(burst.every.scale(9, 10))
        });
        is_in_burst || self.chance(index, 0).happens(self.script.skipped_per_mille)
    }

    /// Chance that belongs to one refresh, so that asking twice gives one answer.
    fn chance(&self, index: i64, purpose: u64) -> SplitMix64 {
        let mut of_index = SplitMix64::new(self.seed ^ (index.cast_unsigned() << 2) ^ purpose);
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
            assert_eq!(display.slot(latest), Slot { index, at: display.refresh_at(index) });
            assert_eq!(display.slot(latest + MonoSpan::from_ns(1)).index, index + 1);
        }
        let elapsed = display.refresh_at(1_000_000) - display.refresh_at(0);
        assert_eq!(elapsed.as_ns(), 8_333_333_i64 * 1_000_200);
    }

    #[test]
    fn a_deep_display_shows_it_so_many_refreshes_later() {
        let script = DisplayScript::steady(MonoSpan::from_hz(60.0));
        let (shallow, deep) = (display(script), display(DisplayScript { depth: 2, ..script }));
        let submitted_at = shallow.refresh_at(7) - MonoSpan::from_ms(1);
        assert_eq!(deep.slot(submitted_at).index, shallow.slot(submitted_at).index + 2);
    }

    #[test]
    fn skipped_refreshes_show_nothing_new_and_lost_feedback_never_comes() {
        let mut script = DisplayScript::steady(MonoSpan::from_hz(60.0));
        script.skipped_per_mille = 100;
        script.feedback_lost_per_mille = 100;
        let display = display(script);
        let slot = |index| display.slot(display.refresh_at(index) - LATCH);
        let skipped = (0..1_000).filter(|&index| slot(index).index != index).count();
        let is_lost = |&index: &i64| {
            display.feedback(Slot { index, at: display.refresh_at(index) }).is_none()
        };
        let lost = (0..1_000).filter(is_lost).count();
        assert!((60..140).contains(&skipped), "{skipped} of 1000 skipped");
        assert!((60..140).contains(&lost), "{lost} of 1000 lost");
    }

    #[test]
    fn in_a_burst_every_refresh_is_skipped_and_none_outside() {
        let mut script = DisplayScript::steady(MonoSpan::from_ms(10));
        script.burst =
            Some(MissBurst { every: MonoSpan::from_ms(1_000), length: MonoSpan::from_ms(50) });
        let display = display(script);
        let skipped: Vec<i64> = (0..200).filter(|&index| display.is_skipped(index)).collect();
        assert_eq!(skipped, [50, 51, 52, 53, 54, 150, 151, 152, 153, 154]);
    }

    #[test]
    fn a_variable_display_shows_at_once_unless_it_has_just_shown_something() {
        let mut script = DisplayScript::steady(MonoSpan::from_ms(8));
        script.kind = RefreshKind::Variable;
        let mut display = display(script);
        let at = |us: i64| MonoTime::from_ns(2_000_000_000) + MonoSpan::from_us(us);
        let first = display.slot(at(0));
        assert_eq!(first, Slot { index: 0, at: at(100) });
        display.show(first);
        assert_eq!(display.slot(at(500)), Slot { index: 1, at: at(8_100) });
        assert_eq!(display.slot(at(9_000)), Slot { index: 1, at: at(9_100) });
    }
}
