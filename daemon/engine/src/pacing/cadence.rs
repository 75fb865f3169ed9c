//! Learns how often keys come and when the next one is overdue.
//!
//! A key is late when content time has run farther ahead of its predecessor than it usually has by
//! the time that the successor can be shown. That one number, first refresh of a key minus the
//! content time of the key before, holds the key interval, the jitter of content times and the
//! jitter of arrivals together. Statistics are ranks, so that the late and missing keys which they
//! are there to detect do not move them.
//!
//! It also tells until when no key is to be expected, from the shortest interval and the earliest
//! arrival among recent keys.

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
/// Key intervals are even if from the 5th to the 95th percentile they differ by less than a tenth
/// of the refresh interval.
const EVEN_DIVISOR: i64 = 10;
/// No key of late was early enough to come this much before it is expected.
const SURPRISE: MonoSpan = MonoSpan::from_us(500);
/// An application keeps up with a display if its usual key interval is at most this share of the
/// refresh interval, in percent, and even,
const KEEP_UP_PERCENT: i64 = 102;
/// or if it is this much faster, however uneven.
const FAST_PERCENT: i64 = 70;

/// When keys come.
#[derive(Clone, Debug, Default)]
pub(super) struct KeyCadence {
    previous: Option<MonoTime>,
    intervals: Recent<INTERVAL_WINDOW>,
    gaps: Recent<GAP_WINDOW>,
    /// From the content time of each key to its arrival.
    arrivals: Recent<GAP_WINDOW>,
    /// Median of `intervals`. None before the second key.
    interval: Option<MonoSpan>,
    /// The longest gap that is no outlier. None without gaps.
    usual_gap: Option<MonoSpan>,
    /// None before `INTERVAL_WINDOW` keys.
    evenness: Option<Evenness>,
    /// None before `INTERVAL_WINDOW` keys.
    quiet_until: Option<MonoTime>,
}

/// How evenly keys come.
#[derive(Clone, Copy, Debug)]
struct Evenness {
    /// 95th percentile of the intervals.
    longest_interval: MonoSpan,
    /// From their 5th percentile to that.
    interval_spread: MonoSpan,
    /// The same of the gaps.
    gap_spread: MonoSpan,
}

impl KeyCadence {
    /// A key with `content_time` has arrived at `arrived_at`; `first_refresh` is the first that can
    /// show it.
    pub(super) fn on_key(
        &mut self,
        content_time: MonoTime,
        arrived_at: MonoTime,
        first_refresh: MonoTime,
    ) {
        if let Some(previous) = self.previous.filter(|&previous| previous < content_time) {
            self.intervals.push(content_time - previous);
            self.gaps.push(first_refresh - previous);
            self.interval = self.intervals.percentile(50);
            self.usual_gap = self.upper_fence();
            self.evenness = self.measure_evenness();
        }
        self.arrivals.push(arrived_at - content_time);
        self.quiet_until = self.next_at_the_earliest(content_time);
        self.previous = Some(content_time);
    }

    /// The application's clock was stepped: gaps measured across the step mean nothing.
    pub(super) fn on_clock_step(&mut self, content_time: MonoTime) {
        self.previous = Some(content_time);
        self.gaps.clear();
        self.arrivals.clear();
        self.quiet_until = None;
        self.usual_gap = None;
        self.evenness = None;
    }

    /// Usual content time from one key to the next. None before the second key.
    pub(super) fn interval(&self) -> Option<MonoSpan> {
        self.interval
    }

    /// No key is expected before this, going by the earliest of recent ones. None if any instant
    /// may bring one.
    pub(super) fn quiet_until(&self) -> Option<MonoTime> {
        self.quiet_until
    }

    /// Whether keys come one for each refresh, or more: there is nothing to put in between then.
    pub(super) fn keeps_up_with(&self, refresh_interval: MonoSpan) -> bool {
        let Some((interval, even)) = self.interval.zip(self.evenness) else { return false };
        let is_even =
            self.is_even(refresh_interval) && even.gap_spread < refresh_interval.scale(1, 2);
        even.longest_interval <= refresh_interval.scale(FAST_PERCENT, 100)
            || (is_even && interval <= refresh_interval.scale(KEEP_UP_PERCENT, 100))
    }

    /// Whether content times of keys are evenly spaced, as seen on such a display.
    pub(super) fn is_even(&self, refresh_interval: MonoSpan) -> bool {
        let most = refresh_interval.scale(1, EVEN_DIVISOR);
        self.evenness.is_some_and(|even| even.interval_spread < most)
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

    fn next_at_the_earliest(&self, content_time: MonoTime) -> Option<MonoTime> {
        let (interval, arrival) = (self.intervals.min()?, self.arrivals.min()?);
        let is_known = self.arrivals.len() >= INTERVAL_WINDOW;
        is_known.then(|| content_time + interval + arrival - SURPRISE)
    }

    fn measure_evenness(&self) -> Option<Evenness> {
        if self.gaps.len() < INTERVAL_WINDOW {
            return None;
        }
        let longest_interval = self.intervals.percentile(95)?;
        Some(Evenness {
            longest_interval,
            interval_spread: longest_interval - self.intervals.percentile(5)?,
            gap_spread: self.gaps.percentile(95)? - self.gaps.percentile(5)?,
        })
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
        cadence.on_key(ms(100), ms(101), ms(108));
        assert_eq!(cadence.interval(), None);
        assert_eq!(cadence.easing(MonoSpan::from_ms(8)).full_until, FIRST_INTERVAL);
    }

    #[test]
    fn late_and_missing_keys_do_not_move_what_is_usual() {
        let mut cadence = KeyCadence::default();
        for key in 0..64 {
            if key % 16 != 3 {
                let late = if key % 16 == 9 { 60 } else { 0 };
                cadence.on_key(ms(key * 25), ms(key * 25), ms(key * 25 + 8 + late));
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
            cadence.on_key(ms(key * 25), ms(key * 25), ms(key * 25 + 8 + (key * 7) % 11));
        }
        let easing = cadence.easing(MonoSpan::from_ms(8));
        assert!(easing.full_until >= MonoSpan::from_ms(34), "{easing:?}");
        assert!(easing.full_until <= MonoSpan::from_ms(40), "{easing:?}");
    }

    #[test]
    fn no_key_is_expected_before_the_earliest_of_late() {
        let mut cadence = KeyCadence::default();
        let mut quiet = vec![];
        for key in 0..64 {
            let arrived_at = ms(key * 25 + 5 + (key % 4));
            quiet.push((arrived_at, cadence.quiet_until()));
            cadence.on_key(ms(key * 25), arrived_at, ms(key * 25 + 8));
        }
        assert_eq!(quiet[INTERVAL_WINDOW - 1].1, None, "too few to tell");
        for (arrived_at, until) in &quiet[INTERVAL_WINDOW..] {
            let early = *arrived_at - until.unwrap();
            assert!(early >= SURPRISE && early <= MonoSpan::from_ms(3) + SURPRISE, "{early:?}");
        }
        cadence.on_clock_step(ms(5_000));
        assert_eq!(cadence.quiet_until(), None, "nothing is known after a step");
    }

    #[test]
    fn keys_one_for_each_refresh_keep_up_and_others_do_not() {
        let refresh = MonoSpan::from_ms(10);
        let keeps_up = |key_us: i64, jitter_us: i64, wait: fn(i64) -> i64| {
            let mut cadence = KeyCadence::default();
            for key in 0..64 {
                let content = key * key_us + (key % 2) * jitter_us;
                let time = |us| MonoTime::ZERO + MonoSpan::from_us(us);
                cadence.on_key(time(content), time(content), time(content + wait(key)));
            }
            cadence.keeps_up_with(refresh)
        };
        assert!(keeps_up(10_000, 0, |_| 9_000));
        assert!(keeps_up(10_100, 0, |_| 9_000), "a little slower");
        assert!(!keeps_up(10_400, 0, |_| 9_000), "slower");
        assert!(!keeps_up(10_000, 3_000, |_| 9_000), "uneven content");
        assert!(!keeps_up(10_000, 0, |key| 9_000 + key % 3 * 5_000), "uneven arrivals");
        assert!(keeps_up(5_000, 1_500, |key| 9_000 + key % 3 * 3_000), "much faster");
        let few = KeyCadence::default();
        assert!(!few.keeps_up_with(refresh), "unknown");
    }
}
