//! Tracks the display's refresh interval and phase from presentation feedback.
//!
//! An alpha-beta filter: a timestamp t is compared with the nearest predicted refresh p, and
//! p += alpha (t - p), interval += beta (t - p) / refreshes since the last timestamp. A frame that
//! was shown whole refreshes late therefore does not disturb the grid. Both gains start high and
//! fall, so that a display which is a few percent off is caught and a good one is smoothed.
//!
//! Timestamps far from the grid are distrusted until several in a row say so, or until the display
//! was not heard of for so long that the grid is no better than they are. The interval stays near
//! the announced one, unless [`RateDoubt`] proves that one wrong.

use super::rate_doubt::{Answer, RateDoubt};
use crate::time::{MonoSpan, MonoTime};

/// Fraction bits of the instants and intervals inside: at 1 ns, the rounding of one interval
/// would add up to a refresh within weeks.
const FRACTION: u32 = 16;
/// Gain of the phase, as a divisor: first, and from the eighth timestamp on. At 8, timestamp noise
/// is damped to a quarter.
const ALPHA_DIVISORS: (i128, i128) = (2, 8);
/// Gain of the interval, as a divisor: first, and in the end. Critical damping would allow
/// alpha^2 / (2 - alpha) = 1/120; a quarter of it follows crystals that drift by ppm just as well
/// and doubles the quiet. At first a display 6 % off has to be caught before it leaves the gate.
const BETA_DIVISORS: (i128, i128) = (24, 512);
/// By how much the divisor of beta grows with each timestamp: the last one is reached after 122.
const BETA_GROWTH: i128 = 4;
/// A timestamp farther from the grid than this share of the interval is an outlier, in percent.
const GATE_PERCENT: i128 = 35;
/// So many outliers in a row mean that the grid has moved, not the timestamps.
const OUTLIERS_TO_REPHASE: u32 = 6;
/// Without feedback for this long the phase is no longer known: at 200 ppm it has moved by a tenth
/// of a millisecond and more, and a machine that was suspended has lost it altogether.
const PHASE_LIFE: i128 = 500_000_000 << FRACTION;
/// The tracked interval stays within announced / this of the announced one.
const INTERVAL_BOUND_DIVISOR: i128 = 16;
/// Announced intervals are clamped to this range (ns): 10 kHz to 1 Hz.
const ANNOUNCED_RANGE: (i64, i64) = (100_000, 1_000_000_000);

/// The grid of refreshes as far as it is known.
#[derive(Clone, Debug)]
pub(super) struct RefreshTracker {
    /// Announced interval or what measurement put in its place, fixed point.
    announced: i128,
    /// Tracked interval, fixed point, within its bounds around `announced`.
    interval: i128,
    /// A refresh, fixed point; the newest that feedback told of. None until anything is known.
    anchor: Option<i128>,
    /// Whether `anchor` comes from the display and not from our own first plan.
    is_measured: bool,
    /// Timestamps that were followed since the grid began.
    followed: u32,
    doubt: RateDoubt,
    /// The newest timestamp, followed or not.
    newest: Option<MonoTime>,
    outliers_in_a_row: u32,
    outliers: u64,
}

impl RefreshTracker {
    pub(super) fn new(announced: MonoSpan, known_refresh: Option<MonoTime>) -> Self {
        let announced = clamped(announced);
        Self {
            announced,
            interval: announced,
            anchor: known_refresh.map(fixed),
            is_measured: known_refresh.is_some(),
            followed: 0,
            doubt: RateDoubt::default(),
            newest: None,
            outliers_in_a_row: 0,
            outliers: 0,
        }
    }

    /// The display has changed its mode and announces `announced`: nothing known of the old grid
    /// holds, but the next refreshes are guessed from it until feedback comes.
    pub(super) fn on_mode(&mut self, announced: MonoSpan) {
        let outliers = self.outliers;
        let anchor = self.anchor;
        *self = Self { anchor, outliers, ..Self::new(announced, None) };
    }

    /// Time between two refreshes, to the nearest nanosecond.
    pub(super) fn interval(&self) -> MonoSpan {
        MonoSpan::from_ns(saturate((self.interval + HALF) >> FRACTION))
    }

    /// Timestamps that were off the grid and not followed.
    pub(super) fn outliers(&self) -> u64 {
        self.outliers
    }

    /// Whether anything is known of when the display refreshes.
    pub(super) fn is_measured(&self) -> bool {
        self.is_measured
    }

    /// Whether the announced rate was replaced by a measured one.
    pub(super) fn is_corrected(&self) -> bool {
        self.doubt.is_corrected()
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

    /// The display has shown a frame at `presented_at`, and `superseded` frames before it never.
    pub(super) fn on_presented(&mut self, presented_at: MonoTime, superseded: u32) {
        if self.newest.is_some_and(|newest| presented_at <= newest) {
            return; // out of order: newer feedback has said more
        }
        let since_newest = self.newest.map(|newest| presented_at - newest);
        self.newest = Some(presented_at);
        let time = fixed(presented_at);
        let (Some(anchor), true) = (self.anchor, self.is_measured) else {
            return self.begin_at(time);
        };
        let refreshes = (time - anchor + self.interval / 2).div_euclid(self.interval);
        if refreshes < 0 {
            return;
        }
        let predicted = anchor + refreshes * self.interval;
        let residual = time - predicted;
        let is_outlier = residual.abs() * 100 > self.interval * GATE_PERCENT;
        let answer = Answer {
            interval: since_newest,
            superseded,
            residual: MonoSpan::from_ns(saturate(residual >> FRACTION)),
        };
        let announced = MonoSpan::from_ns(saturate(self.announced >> FRACTION));
        if let Some(measured) = self.doubt.on_answer(&answer, announced) {
            self.announced = clamped(measured);
            self.interval = self.announced;
            return self.begin_at(time);
        }
        if is_outlier {
            self.outliers += 1;
            self.outliers_in_a_row += 1;
            let is_stale = time - anchor > PHASE_LIFE;
            if is_stale || self.outliers_in_a_row >= OUTLIERS_TO_REPHASE {
                self.begin_at(time);
            }
            return;
        }
        self.outliers_in_a_row = 0;
        let (alpha, beta) = self.gains();
        self.followed = self.followed.saturating_add(1);
        self.anchor = Some(predicted + residual / alpha);
        let bound = self.announced / INTERVAL_BOUND_DIVISOR;
        self.interval = (self.interval + residual / (beta * refreshes.max(1)))
            .clamp(self.announced - bound, self.announced + bound);
    }

    /// The grid was no display's, but what came back of our own pace: it begins anew at `time`, and
    /// is not slower than announced.
    pub(super) fn restart_at(&mut self, time: MonoTime) {
        self.interval = self.interval.min(self.announced);
        self.begin_at(fixed(time));
    }

    /// The grid begins anew at `time`, with the interval as it is.
    fn begin_at(&mut self, time: i128) {
        self.anchor = Some(time);
        self.is_measured = true;
        self.followed = 0;
        self.outliers_in_a_row = 0;
    }

    /// Divisors of the next residual.
    fn gains(&self) -> (i128, i128) {
        let followed = i128::from(self.followed);
        let alpha = (ALPHA_DIVISORS.0 + followed).min(ALPHA_DIVISORS.1);
        let beta = (BETA_DIVISORS.0 + BETA_GROWTH * followed).min(BETA_DIVISORS.1);
        (alpha, beta)
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

fn clamped(announced: MonoSpan) -> i128 {
    i128::from(announced.as_ns().clamp(ANNOUNCED_RANGE.0, ANNOUNCED_RANGE.1)) << FRACTION
}

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
            tracker.on_presented(START + truth.scale(frame, 1) + chance.within(jitter), 0);
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
                    tracker.on_presented(next + chance.within(MonoSpan::from_us(100)), 0);
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
        tracker.on_presented(next + shifted, 0);
        assert_eq!(tracker.at_or_after(next), next);
        assert_eq!(tracker.outliers(), 1);
        for frame in 102..=107 {
            tracker.on_presented(START + truth.scale(frame, 1) + shifted, 0);
        }
        assert_eq!(tracker.at_or_after(next), next + shifted);
    }

    #[test]
    fn frames_shown_whole_refreshes_late_leave_the_grid_alone() {
        let (mut tracker, truth) = watched(60.0, 0, MonoSpan::ZERO, 50);
        tracker.on_presented(START + truth.scale(53, 1), 0);
        assert_eq!(tracker.interval(), truth);
        assert_eq!(tracker.at_or_after(START + truth.scale(60, 1)), START + truth.scale(60, 1));
    }

    #[test]
    fn old_feedback_changes_nothing() {
        let (mut tracker, truth) = watched(60.0, 0, MonoSpan::ZERO, 50);
        let before = format!("{tracker:?}");
        tracker.on_presented(START + truth.scale(40, 1) + MonoSpan::from_us(800), 0);
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

    #[test]
    fn a_display_a_few_percent_off_is_caught_by_the_high_first_gains() {
        for ppm in [-50_000, 50_000] {
            let (tracker, truth) = watched(60.0, ppm, MonoSpan::from_us(50), 120);
            let error = (tracker.interval() - truth).max(truth - tracker.interval());
            assert!(error < MonoSpan::from_us(20), "{ppm} ppm: off by {error:?}");
        }
    }

    #[test]
    fn after_a_long_silence_the_first_timestamp_is_believed() {
        let (mut tracker, truth) = watched(60.0, 0, MonoSpan::ZERO, 200);
        let woken = START + truth.scale(200 + 3_000, 1) + truth.scale(2, 5);
        tracker.on_presented(woken, 0);
        assert_eq!(tracker.at_or_after(woken), woken);
        assert_eq!(tracker.interval(), truth);
    }

    #[test]
    fn a_new_mode_counts_from_its_first_timestamp() {
        let (mut tracker, _) = watched(60.0, 100, MonoSpan::from_us(50), 200);
        tracker.on_mode(MonoSpan::from_hz(144.0));
        assert_eq!(tracker.interval(), MonoSpan::from_hz(144.0));
        let shown = START + MonoSpan::from_ms(9_000);
        tracker.on_presented(shown, 0);
        assert_eq!(tracker.at_or_after(shown), shown);
    }
}
