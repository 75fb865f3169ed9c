//! Tracks the display's refresh interval and phase from presentation feedback.
//!
//! An alpha-beta filter: a timestamp t is compared with the nearest predicted refresh p, and
//! p += ALPHA (t - p), interval += BETA (t - p) / refreshes since the last timestamp. A frame that
//! was shown whole refreshes late therefore does not disturb the grid. Timestamps far from the
//! grid are distrusted until several in a row say so; the interval stays near the announced one.

use crate::time::{MonoSpan, MonoTime};

/// Fraction bits of the instants and intervals inside: at 1 ns, the rounding of one interval
/// would add up to a refresh within weeks.
const FRACTION: u32 = 16;
/// Gain of the phase, as a divisor. At 8, timestamp noise is damped to a quarter.
const ALPHA_DIVISOR: i128 = 8;
/// Gain of the interval, as a divisor. Critical damping would allow alpha^2 / (2 - alpha) = 1/120;
/// a quarter of it follows crystals that drift by ppm just as well and doubles the quiet.
const BETA_DIVISOR: i128 = 512;
/// A timestamp farther from the grid than this share of the interval is an outlier, in percent.
const GATE_PERCENT: i128 = 35;
/// So many outliers in a row mean that the grid has moved, not the timestamps.
const OUTLIERS_TO_REPHASE: u32 = 6;
/// The tracked interval stays within announced / this of the announced one.
const INTERVAL_BOUND_DIVISOR: i128 = 16;
/// Announced intervals are clamped to this range (ns): 10 kHz to 1 Hz.
const ANNOUNCED_RANGE: (i64, i64) = (100_000, 1_000_000_000);

/// The grid of refreshes as far as it is known.
#[derive(Clone, Debug)]
pub(super) struct RefreshTracker {
    /// Announced interval, fixed point.
    announced: i128,
    /// Tracked interval, fixed point, within its bounds around `announced`.
    interval: i128,
    /// A refresh, fixed point; the newest that feedback told of. None until anything is known.
    anchor: Option<i128>,
    /// Whether `anchor` comes from the display and not from our own first plan.
    is_measured: bool,
    outliers_in_a_row: u32,
    outliers: u64,
}

impl RefreshTracker {
    pub(super) fn new(announced: MonoSpan, known_refresh: Option<MonoTime>) -> Self {
        let ns = announced.as_ns().clamp(ANNOUNCED_RANGE.0, ANNOUNCED_RANGE.1);
        let announced = i128::from(ns) << FRACTION;
        Self {
            announced,
            interval: announced,
            anchor: known_refresh.map(fixed),
            is_measured: known_refresh.is_some(),
            outliers_in_a_row: 0,
            outliers: 0,
        }
    }

    /// Time between two refreshes, to the nearest nanosecond.
    pub(super) fn interval(&self) -> MonoSpan {
        MonoSpan::from_ns(saturate((self.interval + HALF) >> FRACTION))
    }

    /// Timestamps that were off the grid and not followed.
    pub(super) fn outliers(&self) -> u64 {
        self.outliers
    }

    /// Puts the grid on `time` if nothing better is known.
    pub(super) fn anchor_at(&mut self, time: MonoTime) {
        self.anchor.get_or_insert(fixed(time));
    }

    /// The first refresh at or after `time`, to the nearest nanosecond; `time` itself without grid.
    pub(super) fn at_or_after(&self, time: MonoTime) -> MonoTime {
        let Some(anchor) = self.anchor else { return time };
        // Half a nanosecond early, so that a refresh that was rounded down is found again.
        let after = fixed(time) - HALF - anchor;
        let refreshes = (after + self.interval - 1).div_euclid(self.interval);
        let ns = (anchor + refreshes * self.interval + HALF) >> FRACTION;
        MonoTime::ZERO + MonoSpan::from_ns(saturate(ns.max(0)))
    }

    /// The display has shown a frame at `presented_at`.
    pub(super) fn on_presented(&mut self, presented_at: MonoTime) {
        let time = fixed(presented_at);
        let (Some(anchor), true) = (self.anchor, self.is_measured) else {
            self.anchor = Some(time);
            self.is_measured = true;
            return;
        };
        let refreshes = (time - anchor + self.interval / 2).div_euclid(self.interval);
        if refreshes < 0 {
            return; // out of order: newer feedback has said more
        }
        let predicted = anchor + refreshes * self.interval;
        let residual = time - predicted;
        if residual.abs() * 100 > self.interval * GATE_PERCENT {
            self.outliers += 1;
            self.outliers_in_a_row += 1;
            if self.outliers_in_a_row >= OUTLIERS_TO_REPHASE {
                self.anchor = Some(time);
                self.outliers_in_a_row = 0;
            }
            return;
        }
        self.outliers_in_a_row = 0;
        self.anchor = Some(predicted + residual / ALPHA_DIVISOR);
        let bound = self.announced / INTERVAL_BOUND_DIVISOR;
        self.interval = (self.interval + residual / (BETA_DIVISOR * refreshes.max(1)))
            .clamp(self.announced - bound, self.announced + bound);
    }

    pub(super) fn verify_invariants(&self) {
        let bound = self.announced / INTERVAL_BOUND_DIVISOR;
        assert!(
            (self.interval - self.announced).abs() <= bound,
            "interval out of bounds: {self:?}"
        );
        assert!(self.outliers_in_a_row < OUTLIERS_TO_REPHASE, "rephasing was missed: {self:?}");
        assert!(self.anchor.is_some() || !self.is_measured, "measured without a grid: {self:?}");
    }
}

const HALF: i128 = 1 << (FRACTION - 1);

fn fixed(time: MonoTime) -> i128 {
    i128::from(time.as_ns()) << FRACTION
}

fn saturate(ns: i128) -> i64 {
    i64::try_from(ns).unwrap_or(if ns < 0 { i64::MIN } else { i64::MAX })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pacing::sim::SplitMix64;

    const START: MonoTime = MonoTime::ZERO;

    /// Timestamps of a display whose period is `ppm` longer than announced, +- `jitter`.
    fn watched(hz: f64, ppm: i64, jitter: MonoSpan, frames: i64) -> (RefreshTracker, MonoSpan) {
        let announced = MonoSpan::from_hz(hz);
        let truth = announced.scale(1_000_000 + ppm, 1_000_000);
        let mut tracker = RefreshTracker::new(announced, None);
        let mut chance = SplitMix64::new(1);
        for frame in 1..=frames {
            tracker.on_presented(START + truth.scale(frame, 1) + chance.within(jitter));
            tracker.verify_invariants();
        }
        (tracker, truth)
    }

    #[test]
    fn after_120_noisy_frames_the_next_refresh_is_predicted_within_a_tenth_of_a_millisecond() {
        for hz in [48.0, 59.94, 60.0, 119.88, 144.0, 240.0] {
            for ppm in [-200, 0, 200] {
                let (mut tracker, truth) = watched(hz, ppm, MonoSpan::from_us(100), 120);
                let mut chance = SplitMix64::new(2);
                let mut hits = 0;
                for frame in 121..=1_120 {
                    let next = START + truth.scale(frame, 1);
                    let predicted = tracker.at_or_after(next - truth.scale(1, 2));
                    let error = (predicted - next).max(next - predicted);
                    hits += i32::from(error <= MonoSpan::from_us(100));
                    tracker.on_presented(next + chance.within(MonoSpan::from_us(100)));
                }
                assert!(hits >= 950, "{hz} Hz {ppm} ppm: {hits} of 1000 within 0.1 ms");
            }
        }
    }

    #[test]
    fn wild_timestamps_are_counted_and_not_followed_unless_they_agree() {
        let (mut tracker, truth) = watched(120.0, 0, MonoSpan::ZERO, 100);
        let shifted = truth.scale(1, 2);
        let next = START + truth.scale(101, 1);
        tracker.on_presented(next + shifted);
        assert_eq!(tracker.at_or_after(next), next);
        assert_eq!(tracker.outliers(), 1);
        for frame in 102..=107 {
            tracker.on_presented(START + truth.scale(frame, 1) + shifted);
        }
        assert_eq!(tracker.at_or_after(next), next + shifted);
    }

    #[test]
    fn frames_shown_whole_refreshes_late_leave_the_grid_alone() {
        let (mut tracker, truth) = watched(60.0, 0, MonoSpan::ZERO, 50);
        tracker.on_presented(START + truth.scale(53, 1));
        assert_eq!(tracker.interval(), truth);
        assert_eq!(tracker.at_or_after(START + truth.scale(60, 1)), START + truth.scale(60, 1));
    }

    #[test]
    fn old_feedback_changes_nothing() {
        let (mut tracker, truth) = watched(60.0, 0, MonoSpan::ZERO, 50);
        let before = format!("{tracker:?}");
        tracker.on_presented(START + truth.scale(40, 1) + MonoSpan::from_us(800));
        assert_eq!(format!("{tracker:?}"), before);
    }

    #[test]
    fn the_grid_does_not_drift_by_rounding() {
        let third = MonoSpan::from_ns(16_666_667);
        let tracker = RefreshTracker::new(third, Some(START));
        let far = START + third.scale(10_000_000, 1);
        assert_eq!(tracker.at_or_after(far), far);
        assert_eq!(tracker.at_or_after(far + MonoSpan::from_ns(1)), far + third);
    }
}
