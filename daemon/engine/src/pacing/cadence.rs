//! Learns how often keys come and when the next one is overdue.
//!
//! A key is late when content time has run farther ahead of its predecessor than it usually has by
//! the time that the successor can be shown. That one number, first refresh of a key minus the
//! content time of the key before, holds the key interval, the jitter of content times and the
//! jitter of arrivals together. Statistics are ranks, so that the late and missing keys which they
//! are there to detect do not move them.

use super::easing::Easing;
use super::recent::Recent;
use crate::time::{MonoSpan, MonoTime};

/// Keys that the interval looks back on. Half of them follow a new rate within 0.4 s at 40 Hz.
const INTERVAL_WINDOW: usize = 32;
/// Keys that the learned jitter looks back on.
const GAP_WINDOW: usize = 64;
/// Key interval before the second key: that of the slowest application that is well served.
const FIRST_INTERVAL: MonoSpan = MonoSpan::from_ms(25);
/// Velocity stays full for at most this many key intervals, in halves, however wild the jitter;
/// with the rest of the easing that keeps the phase below 4.
const LONGEST_LEAD_HALVES: i64 = 5;

/// When keys come.
#[derive(Clone, Debug, Default)]
pub(super) struct KeyCadence {
    previous: Option<MonoTime>,
    intervals: Recent<INTERVAL_WINDOW>,
    gaps: Recent<GAP_WINDOW>,
    /// Median of `intervals`. None before the second key.
    interval: Option<MonoSpan>,
    /// The longest gap that is no outlier. None without gaps.
    usual_gap: Option<MonoSpan>,
}

impl KeyCadence {
    /// A key with `content_time` has arrived; `first_refresh` is the first that can show it.
    pub(super) fn on_key(&mut self, content_time: MonoTime, first_refresh: MonoTime) {
        if let Some(previous) = self.previous.filter(|&previous| previous < content_time) {
            self.intervals.push(content_time - previous);
            self.gaps.push(first_refresh - previous);
            self.interval = self.intervals.percentile(50);
            self.usual_gap = self.upper_fence();
        }
        self.previous = Some(content_time);
    }

    /// The application's clock was stepped: gaps measured across the step mean nothing.
    pub(super) fn on_clock_step(&mut self, content_time: MonoTime) {
        self.previous = Some(content_time);
        self.gaps.clear();
        self.usual_gap = None;
    }

    /// Usual content time from one key to the next. None before the second key.
    pub(super) fn interval(&self) -> Option<MonoSpan> {
        self.interval
    }

    /// How content time may run ahead of a key while present time is `delay` ahead of it.
    pub(super) fn easing(&self, delay: MonoSpan) -> Easing {
        let interval = self.interval().unwrap_or(FIRST_INTERVAL);
        let usual = self.usual_gap.map_or(interval, |gap| gap - delay);
        let longest = interval.scale(LONGEST_LEAD_HALVES, 2);
        Easing::after(usual.clamp(interval, longest), interval)
    }

    /// Tukey's fence for outliers, of the upper half alone: a quarter of all keys may be late.
    fn upper_fence(&self) -> Option<MonoSpan> {
        let (middle, upper) = (self.gaps.percentile(50)?, self.gaps.percentile(75)?);
        Some(upper + (upper - middle).scale(2, 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_ns(ms * 1_000_000)
    }

    #[test]
    fn one_key_alone_moves_on_for_the_usual_interval_of_a_slow_application() {
        let mut cadence = KeyCadence::default();
        cadence.on_key(ms(100), ms(108));
        assert_eq!(cadence.interval(), None);
        assert_eq!(cadence.easing(MonoSpan::from_ms(8)).full_until, FIRST_INTERVAL);
    }

    #[test]
    fn late_and_missing_keys_do_not_move_what_is_usual() {
        let mut cadence = KeyCadence::default();
        for key in 0..64 {
            if key % 16 != 3 {
                let late = if key % 16 == 9 { 60 } else { 0 };
                cadence.on_key(ms(key * 25), ms(key * 25 + 8 + late));
            }
        }
        assert_eq!(cadence.interval(), Some(MonoSpan::from_ms(25)));
        let easing = cadence.easing(MonoSpan::from_ms(8));
        assert_eq!(easing.full_until, MonoSpan::from_ms(25));
    }

    #[test]
    fn jitter_of_arrivals_postpones_the_overdue_instant() {
        let mut cadence = KeyCadence::default();
        for key in 0..64 {
            cadence.on_key(ms(key * 25), ms(key * 25 + 8 + (key * 7) % 11));
        }
        let easing = cadence.easing(MonoSpan::from_ms(8));
        assert!(easing.full_until >= MonoSpan::from_ms(34), "{easing:?}");
        assert!(easing.full_until <= MonoSpan::from_ms(40), "{easing:?}");
    }
}
