//! Finds out whether a display refreshes at the rate that it announces.
//!
//! Some do not: a headless compositor may say 60 Hz and deliver 39.7. Such a display gives itself
//! away in two manners: the usual time between two pictures is no whole number of announced
//! intervals, or one of our frames after the other is superseded by the next, although no more of
//! them came than refreshes were announced.
//!
//! A compositor with too much to do looks alike for a while. Hence three guards: what is believed
//! must be regular, it must lie within [`BOUND`], and once the phase was good for long enough
//! ([`ANSWERS_TO_SETTLE`]) nothing is doubted any more until the mode changes.

use super::recent::Recent;
use crate::time::MonoSpan;

/// Intervals that a verdict rests on: half a second at 60 Hz.
const WINDOW: usize = 31;
/// An interval this much off a whole number of announced ones is doubtful, in percent.
const OFF_WHOLE_PERCENT: i64 = 15;
/// Between the 10th and the 90th percentile of regular intervals lies at most this share of the
/// median. Measured on weston: 1 to 5 %; on a compositor that is overloaded: 50 % and more.
const SPREAD_PERCENT: i64 = 12;
/// Believed intervals are at most this many announced ones. It delivered 1.5 where it was seen.
const BOUND: i64 = 3;
/// So many answers in a row near the grid, one refresh after the other, settle the matter.
const ANSWERS_TO_SETTLE: u32 = 64;
/// Near: within this share of the interval, in percent.
const NEAR_PERCENT: i64 = 20;

/// What one presentation timestamp says about the rate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    /// Time since the timestamp before. None for the first.
    pub(super) interval: Option<MonoSpan>,
    /// Frames handed over in between that were never shown.
    pub(super) superseded: u32,
    /// Distance to the grid.
    pub(super) residual: MonoSpan,
}

/// Evidence against the announced rate.
#[derive(Clone, Debug, Default)]
pub(super) struct RateDoubt {
    intervals: Recent<WINDOW>,
    /// Of the newest intervals in a row, those in which a frame was superseded.
    crowded_in_a_row: u32,
    near_in_a_row: u32,
    is_settled: bool,
    is_corrected: bool,
}

impl RateDoubt {
    /// Whether a measured rate has taken the place of the announced one.
    pub(super) fn is_corrected(&self) -> bool {
        self.is_corrected
    }

    /// Hears an answer; returns the refresh interval to believe in if it is not `announced`.
    pub(super) fn on_answer(&mut self, answer: &Answer, announced: MonoSpan) -> Option<MonoSpan> {
        let interval = answer.interval?;
        let is_next = (interval - announced).scale(4, 1);
        let is_next = is_next < announced && is_next > -announced;
        let near = announced.scale(NEAR_PERCENT, 100);
        let is_near = is_next && answer.residual < near && answer.residual > -near;
        self.near_in_a_row = if is_near { self.near_in_a_row.saturating_add(1) } else { 0 };
        self.is_settled |= self.near_in_a_row >= ANSWERS_TO_SETTLE;
        if self.is_settled {
            return None;
        }
        self.intervals.push(interval);
        self.crowded_in_a_row =
            if answer.superseded > 0 { self.crowded_in_a_row.saturating_add(1) } else { 0 };
        let measured = self.verdict(announced)?;
        self.intervals.clear();
        self.crowded_in_a_row = 0;
        self.is_corrected = true;
        Some(measured)
    }

    fn verdict(&self, announced: MonoSpan) -> Option<MonoSpan> {
        if self.intervals.len() < WINDOW {
            return None;
        }
        let at = |percent| self.intervals.percentile(percent);
        let (low, median, high) = (at(10)?, at(50)?, at(90)?);
        let is_regular = high - low <= median.scale(SPREAD_PERCENT, 100);
        let is_bounded = median <= announced.scale(BOUND, 1) && median.scale(2, 1) >= announced;
        let whole = ((median + announced.scale(1, 2)).as_ns() / announced.as_ns().max(1)).max(1);
        let off = median - announced.scale(whole, 1);
        let allowed = announced.scale(OFF_WHOLE_PERCENT, 100);
        let is_off = off > allowed || off < -allowed;
        let is_crowded = whole > 1 && self.crowded_in_a_row as usize >= WINDOW;
        (is_regular && is_bounded && (is_off || is_crowded)).then_some(median)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANNOUNCED: MonoSpan = MonoSpan::from_ns(16_666_667);

    fn hear(doubt: &mut RateDoubt, us: i64, superseded: u32) -> Option<MonoSpan> {
        let answer = Answer {
            interval: Some(MonoSpan::from_us(us)),
            superseded,
            residual: MonoSpan::from_us((us - 16_667).rem_euclid(16_667)),
        };
        doubt.on_answer(&answer, ANNOUNCED)
    }

    /// The verdict on 40 answers with intervals from `us`, over and over.
    fn judged(us: &[i64], superseded: u32) -> Option<MonoSpan> {
        let mut doubt = RateDoubt::default();
        us.iter().cycle().take(40).find_map(|&us| hear(&mut doubt, us, superseded))
    }

    #[test]
    fn a_regular_interval_that_is_no_whole_number_of_announced_ones_is_believed() {
        assert_eq!(judged(&[25_160, 25_200, 25_320], 0), Some(MonoSpan::from_us(25_200)));
        assert_eq!(judged(&[16_600, 16_700], 0), None);
        assert_eq!(judged(&[33_300, 33_400], 0), None, "every second refresh was skipped");
    }

    #[test]
    fn twice_the_interval_is_believed_only_where_frames_are_superseded_every_time() {
        assert_eq!(judged(&[33_300, 33_400], 1), Some(MonoSpan::from_us(33_300)));
        assert_eq!(judged(&[16_600, 16_700], 1), None, "the rate is as announced");
    }

    #[test]
    fn an_overloaded_compositor_is_no_other_rate() {
        assert_eq!(judged(&[25_000, 41_000, 33_000, 17_000], 0), None, "irregular");
        assert_eq!(judged(&[120_000], 3), None, "out of bounds");
    }

    #[test]
    fn once_the_phase_was_good_for_long_nothing_is_doubted() {
        let mut doubt = RateDoubt::default();
        (0..ANSWERS_TO_SETTLE).for_each(|_| assert_eq!(hear(&mut doubt, 16_667, 0), None));
        assert!((0..100).all(|_| hear(&mut doubt, 25_200, 1).is_none()));
        let mut fresh = RateDoubt::default();
        (1..ANSWERS_TO_SETTLE).for_each(|_| assert_eq!(hear(&mut fresh, 16_667, 0), None));
        assert!((0..100).any(|_| hear(&mut fresh, 25_200, 1).is_some()), "one answer short");
    }
}
