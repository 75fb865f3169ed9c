//! The refresh grid of a sink that has no display behind it (null, image files, y4m, shared
//! memory): instants `origin + n * interval`, computed, so that they never drift.

use crate::time::{MonoSpan, MonoTime};

/// A display that refreshes exactly on a grid.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TimerDisplay {
    origin: MonoTime,
    interval: MonoSpan,
}

impl TimerDisplay {
    /// A display that refreshes at `origin` and every `interval` (at least 1 ns) before and after.
    #[must_use]
    pub fn new(origin: MonoTime, interval: MonoSpan) -> Self {
        Self { origin, interval: interval.max(MonoSpan::from_ns(1)) }
    }

    /// Time between two refreshes.
    #[must_use]
    pub fn interval(&self) -> MonoSpan {
        self.interval
    }

    /// The first refresh at or after `time`: where a frame that was handed over at `time` is shown.
    #[must_use]
    pub fn refresh_at_or_after(&self, time: MonoTime) -> MonoTime {
        let after = i128::from((time - self.origin).as_ns());
        let interval = i128::from(self.interval.as_ns());
        let refreshes = (after + interval - 1).div_euclid(interval);
        let span = i64::try_from(refreshes * interval).unwrap_or(i64::MAX);
        self.origin + MonoSpan::from_ns(span)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_on_the_grid_is_its_own_refresh_and_the_next_ns_is_not() {
        let origin = MonoTime::from_ns(1_000);
        let display = TimerDisplay::new(origin, MonoSpan::from_ns(100));
        let refresh = |ns| display.refresh_at_or_after(MonoTime::from_ns(ns)).as_ns();
        assert_eq!([refresh(1_000), refresh(1_001), refresh(1_100)], [1_000, 1_100, 1_100]);
        assert_eq!([refresh(900), refresh(899), refresh(901)], [900, 900, 1_000]);
    }

    #[test]
    fn the_far_future_saturates() {
        let display = TimerDisplay::new(MonoTime::ZERO, MonoSpan::from_ns(8_333_333));
        assert!(display.refresh_at_or_after(MonoTime::FAR_FUTURE) <= MonoTime::FAR_FUTURE);
    }
}
