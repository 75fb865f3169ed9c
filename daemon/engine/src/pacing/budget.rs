//! How long before a refresh work has to start: the work itself, and a margin for the hand-over.
//!
//! Work is the 95th percentile of recent frames, counted from the last instant to start, so that
//! late scheduling counts as work. A key shown as it is takes a fraction of what an in-between
//! frame takes, and is estimated apart. The margin widens at once after a miss and shrinks slowly.
//!
//! The frames above the 95th percentile live off the margin. Where they take more than that, again
//! and again, the work has spikes: then it is estimated by the longest recent one, as far as that
//! costs no refresh.

use super::recent::Recent;
use crate::time::MonoSpan;

/// What the first in-between frame is expected to take: at 1280x720 and on two processors, while
/// nothing is in any cache.
const FIRST_WORK: MonoSpan = MonoSpan::from_ms(6);
/// Frames that the work estimate looks back on: half a second at 120 Hz.
const WORK_WINDOW: usize = 64;
/// Of fewer there is no 95th percentile: until then half as much again is planned for, but no more
/// than the first guess.
const WORK_TO_LEARN: usize = 20;
/// A twentieth of the frames may take longer than planned and live off the margin.
const WORK_PERCENTILE: usize = 95;
/// Two frames that take more than estimate and margin within so many mean that the work has spikes:
/// 1.6 %, once a second at 120 Hz.
const SPIKY_WITHIN: u32 = 128;
/// Spikes are counted on to be longer than the longest recent one by this, in percent.
const SPIKY_PERCENT: i64 = 125;
/// What spikes may raise work and margin to, as eighths of a refresh. Beyond a whole one, a picture
/// for each refresh could no longer be made.
const SPIKY_EIGHTHS: i64 = 7;
/// What the hand-over itself takes: a message to a compositor, and its latch.
const HAND_OVER: MonoSpan = MonoSpan::from_us(250);
/// Margin that is never given up: the hand-over, and as much again for the work that takes longer
/// than estimated. With less, the margin shrinks into a miss every second or so, again and again.
const MARGIN_FLOOR: MonoSpan = MonoSpan::from_us(500);
/// A miss widens the margin by at least this.
const MARGIN_STEP: MonoSpan = MonoSpan::from_us(500);
/// Each good frame shrinks the margin by 1/50 = 2 % of what is above the floor.
const MARGIN_DECAY_DIVISOR: i64 = 50;

/// How long synthesis is expected to take.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WorkEstimate {
    /// Learned from [`Pacer::on_work`](super::Pacer::on_work); `first` before anything was
    /// measured.
    Measured {
        /// Guess for the first in-between frame.
        first: MonoSpan,
    },
    /// Always this, so that plans repeat exactly.
    Constant(MonoSpan),
}

impl WorkEstimate {
    /// Learned, on a display with these refreshes.
    #[must_use]
    pub fn learned(refresh_interval: MonoSpan) -> Self {
        Self::Measured { first: FIRST_WORK.min(refresh_interval.scale(3, 4)) }
    }
}

/// What a picture shows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Shows {
    /// The newest key as it is.
    Key,
    /// Anything else.
    InBetween,
}

/// What has to happen before a refresh, and how long it takes.
#[derive(Clone, Debug)]
pub(super) struct Budget {
    estimate: WorkEstimate,
    keys: RecentWork,
    in_betweens: RecentWork,
    margin: MonoSpan,
}

/// What recent pictures of one kind took.
#[derive(Clone, Debug, Default)]
struct RecentWork {
    work: Recent<WORK_WINDOW>,
    /// The percentile of `work`. None before anything was measured.
    measured: Option<MonoSpan>,
    /// The longest of `work`.
    longest: MonoSpan,
    /// Whether more than one was measured.
    is_warm: bool,
    /// Frames since the last spike, and since the one before that.
    since_spike: Option<u32>,
    since_spike_before: Option<u32>,
}

impl RecentWork {
    fn push(&mut self, work: MonoSpan, margin: MonoSpan) {
        let later =
            |frames: &mut Option<u32>| *frames = frames.map(|count| count.saturating_add(1));
        later(&mut self.since_spike);
        later(&mut self.since_spike_before);
        if self.measured.is_some_and(|usual| work > usual + margin) {
            self.since_spike_before = self.since_spike.replace(0);
        }
        if !self.is_warm && self.work.len() == 1 {
            self.work.clear(); // the very first found nothing in any cache
            self.is_warm = true;
        }
        self.work.push(work.max(MonoSpan::ZERO));
        self.measured = self.work.percentile(WORK_PERCENTILE);
        self.longest = self.work.percentile(100).unwrap_or_default();
    }

    fn is_spiky(&self) -> bool {
        self.since_spike_before.is_some_and(|frames| frames < SPIKY_WITHIN)
    }
}

impl Budget {
    pub(super) fn new(estimate: WorkEstimate) -> Self {
        let [keys, in_betweens] = [(); 2].map(|()| RecentWork::default());
        Self { estimate, keys, in_betweens, margin: MARGIN_FLOOR }
    }

    /// Expected time from wake to the picture being ready. A key that was not measured yet takes
    /// no longer than an in-between frame; what is made of keys says nothing about these.
    pub(super) fn work(&self, shows: Shows, refresh_interval: MonoSpan) -> MonoSpan {
        match self.estimate {
            WorkEstimate::Constant(work) => work.max(MonoSpan::ZERO),
            WorkEstimate::Measured { first } => {
                let first = first.max(MonoSpan::ZERO);
                let (own, unmeasured) = match shows {
                    Shows::Key => (&self.keys, self.in_betweens.measured.unwrap_or(first)),
                    Shows::InBetween => (&self.in_betweens, first),
                };
                let usual = match own.measured {
                    None => unmeasured,
                    Some(measured) if own.work.len() < WORK_TO_LEARN => {
                        measured.max(first.min(measured.scale(3, 2)))
                    }
                    Some(measured) => measured,
                };
                let room = refresh_interval.scale(SPIKY_EIGHTHS, 8) - self.margin(refresh_interval);
                let spike = own.longest.scale(SPIKY_PERCENT, 100);
                if own.is_spiky() { usual.max(spike.min(room)) } else { usual }
            }
        }
    }

    /// The same for the rule that maps content time, which must not start with a guess that is too
    /// long: shortening it later shows as a jump.
    pub(super) fn work_at_best(&self, refresh_interval: MonoSpan) -> MonoSpan {
        let work = self.work(Shows::InBetween, refresh_interval);
        let measured = self.in_betweens.measured.or(self.keys.measured);
        if self.in_betweens.work.len() < WORK_TO_LEARN {
            work.min(measured.unwrap_or(refresh_interval.scale(1, 4)))
        } else {
            work
        }
    }

    /// Time that the hand-over itself takes.
    pub(super) fn hand_over(&self, refresh_interval: MonoSpan) -> MonoSpan {
        HAND_OVER.min(refresh_interval.scale(1, 2))
    }

    /// Time from the expected end of the work to the refresh: the hand-over, and what misses have
    /// added to it. At most half a refresh.
    pub(super) fn margin(&self, refresh_interval: MonoSpan) -> MonoSpan {
        self.margin.min(refresh_interval.scale(1, 2))
    }

    pub(super) fn on_work(&mut self, shows: Shows, work: MonoSpan) {
        let recent = match shows {
            Shows::Key => &mut self.keys,
            Shows::InBetween => &mut self.in_betweens,
        };
        // What the margin is for without any misses.
        recent.push(work, MARGIN_FLOOR);
    }

    pub(super) fn on_good(&mut self) {
        self.margin -= (self.margin - MARGIN_FLOOR).scale(1, MARGIN_DECAY_DIVISOR);
    }

    pub(super) fn on_miss(&mut self, refresh_interval: MonoSpan) {
        let widened = self.margin + MARGIN_STEP.max(self.margin.scale(1, 2));
        self.margin = widened.min(refresh_interval.scale(1, 2)).max(MARGIN_FLOOR);
    }

    pub(super) fn verify_invariants(&self) {
        assert!(self.margin >= MARGIN_FLOOR, "margin below its floor: {self:?}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFRESH: MonoSpan = MonoSpan::from_ms(8);

    #[test]
    fn one_spike_in_a_window_does_not_move_the_estimate_but_many_do() {
        let mut budget = Budget::new(WorkEstimate::Measured { first: MonoSpan::from_ms(2) });
        let work = |budget: &Budget| budget.work(Shows::InBetween, REFRESH);
        assert_eq!(work(&budget), MonoSpan::from_ms(2));
        (0..WORK_WINDOW).for_each(|_| budget.on_work(Shows::InBetween, MonoSpan::from_ms(3)));
        budget.on_work(Shows::InBetween, MonoSpan::from_ms(30));
        assert_eq!(work(&budget), MonoSpan::from_ms(3));
        (0..5).for_each(|_| budget.on_work(Shows::InBetween, MonoSpan::from_ms(5)));
        assert!(work(&budget) >= MonoSpan::from_ms(5));
    }

    #[test]
    fn keys_and_in_betweens_are_estimated_apart_once_both_were_measured() {
        let mut budget = Budget::new(WorkEstimate::Measured { first: MonoSpan::ZERO });
        budget.on_work(Shows::InBetween, MonoSpan::from_ms(6));
        assert_eq!(budget.work(Shows::Key, REFRESH), MonoSpan::from_ms(6));
        budget.on_work(Shows::Key, MonoSpan::from_ms(1));
        assert_eq!(budget.work(Shows::Key, REFRESH), MonoSpan::from_ms(1));
        assert_eq!(budget.work(Shows::InBetween, REFRESH), MonoSpan::from_ms(6));
    }

    #[test]
    fn the_margin_widens_at_once_shrinks_slowly_and_stays_in_bounds() {
        let mut budget = Budget::new(WorkEstimate::Constant(MonoSpan::ZERO));
        let floor = budget.margin(REFRESH);
        budget.on_miss(REFRESH);
        let widened = budget.margin(REFRESH);
        assert!(widened >= floor + MARGIN_STEP);
        budget.on_good();
        let shrunk = budget.margin(REFRESH);
        assert!(shrunk < widened && shrunk > widened.scale(97, 100), "{shrunk:?}");
        (0..50).for_each(|_| budget.on_miss(REFRESH));
        assert_eq!(budget.margin(REFRESH), REFRESH.scale(1, 2));
        (0..2_000).for_each(|_| budget.on_good());
        assert!(budget.margin(REFRESH) <= floor + MonoSpan::from_us(1));
        budget.verify_invariants();
    }

    #[test]
    fn spikes_that_come_again_are_planned_for_as_far_as_no_refresh_is_lost() {
        let mut budget = Budget::new(WorkEstimate::Measured { first: MonoSpan::ZERO });
        let spike = |budget: &mut Budget, ms: i64| {
            (0..40).for_each(|_| budget.on_work(Shows::InBetween, MonoSpan::from_ms(2)));
            budget.on_work(Shows::InBetween, MonoSpan::from_ms(ms));
        };
        let work = |budget: &Budget| budget.work(Shows::InBetween, REFRESH);
        spike(&mut budget, 5);
        assert_eq!(work(&budget), MonoSpan::from_ms(2), "once is an outlier");
        spike(&mut budget, 5);
        assert_eq!(work(&budget), MonoSpan::from_us(6_250));
        assert_eq!(budget.work(Shows::Key, REFRESH), MonoSpan::from_ms(2), "keys have none");
        spike(&mut budget, 30);
        assert_eq!(work(&budget) + budget.margin(REFRESH), REFRESH.scale(7, 8));
        (0..200).for_each(|_| budget.on_work(Shows::InBetween, MonoSpan::from_ms(2)));
        assert_eq!(work(&budget), MonoSpan::from_ms(2), "forgotten");
    }

    #[test]
    fn the_first_few_pictures_are_given_half_as_much_again() {
        let mut budget = Budget::new(WorkEstimate::Measured { first: MonoSpan::from_ms(7) });
        let work = |budget: &Budget| budget.work(Shows::InBetween, REFRESH);
        assert_eq!(work(&budget), MonoSpan::from_ms(7));
        assert_eq!(budget.work_at_best(REFRESH), REFRESH.scale(1, 4));
        budget.on_work(Shows::Key, MonoSpan::from_ms(1));
        assert_eq!(work(&budget), MonoSpan::from_ms(7), "a key tells nothing");
        budget.on_work(Shows::InBetween, MonoSpan::from_ms(30));
        budget.on_work(Shows::InBetween, MonoSpan::from_ms(2));
        assert_eq!(work(&budget), MonoSpan::from_ms(3), "a slow start is forgotten");
        assert_eq!(budget.work_at_best(REFRESH), MonoSpan::from_ms(2));
        (0..WORK_TO_LEARN).for_each(|_| budget.on_work(Shows::InBetween, MonoSpan::from_ms(2)));
        assert_eq!(work(&budget), MonoSpan::from_ms(2));
    }
}
