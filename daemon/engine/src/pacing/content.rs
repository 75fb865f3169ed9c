//! Maps present time to content time: content time = present time - delay, one smooth line.
//!
//! Each key offers a delay: the first refresh that can show it minus its content time. The
//! smallest offer in a window is the delay at which no key is shown at a negative phase, and at
//! which the best-placed keys are shown as they are, at phase 0. The line never jumps to it: the
//! delay slews, so that keys with uneven content times, and keys that arrive unevenly, move the
//! line by a fraction of a percent of its velocity.
//!
//! Where keys come evenly but arrive unevenly, the offer of an early key is a whole refresh smaller
//! than that of the others, and the first such key would make the line jump. When the display's
//! clock drifts against the application's, that is foreseen: a key that was as early as the
//! earliest of late would reach an earlier refresh by now, so the line already moves there.
//!
//! Two things make it jump, both counted: the application's clock steps (content times run
//! backwards, or leap ahead), or keys stay behind for so long that it is no jitter.

use super::recent::Recent;
use crate::time::{MonoSpan, MonoTime};

/// Keys that the delay looks back on: 3 s at 40 Hz. Shorter and the minimum wanders with jitter,
/// longer and extrapolation stays needlessly long after an early key.
const WINDOW: usize = 128;
/// Time constant with which the delay follows its target. Found with `foreframe pacing`: eight
/// times as long, and one early key keeps all others from being shown as they are for seconds (1
/// real frame of 2400 with arrivals jittering by 2 ms, against 2026), with no less judder.
const FOLLOW_TIME: MonoSpan = MonoSpan::from_ms(500);
/// It changes by at most 1/64 of the time that passes: velocity on the screen stays within 1.6 %,
/// and getting over a whole refresh (8.3 ms in half a second) costs less than 1 % of judder.
const FASTEST_SLEW_DIVISOR: i64 = 64;
/// Content time that leaps ahead by more was set, not jittered.
const FORWARD_STEP: MonoSpan = MonoSpan::from_ms(250);
/// So many keys in a row that lag by more than the caller allows have a new delay: 0.4 s at 40 Hz.
const LAGGING_KEYS: u32 = 16;

/// A key may be earlier than the earliest of late by this before it takes the clock by surprise.
const FORESIGHT: MonoSpan = MonoSpan::from_us(100);

/// A key that has arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct KeyOffer {
    pub(super) content_time: MonoTime,
    /// When its picture could be ready.
    pub(super) ready_at: MonoTime,
    /// The first refresh after that which is not taken.
    pub(super) first_refresh: MonoTime,
    /// A cut lets the line jump at once, for nobody can see it.
    pub(super) is_cut: bool,
}

/// What a key meant for the clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum KeyTiming {
    /// It moved the clock at most slowly.
    Followed,
    /// The application's clock was stepped; content time starts anew from this key.
    Stepped,
    /// Keys have fallen behind for good and the clock has followed; what was shown last is ahead of
    /// it for a moment.
    Relocked,
}

/// The mapping.
#[derive(Clone, Debug, Default)]
pub(super) struct ContentClock {
    newest: Option<MonoTime>,
    offers: Recent<WINDOW>,
    /// From content time to when a picture could be ready.
    readiness: Recent<WINDOW>,
    /// The smallest of `offers`.
    target: Option<MonoSpan>,
    line: Option<Line>,
    lagging: u32,
}

/// The delay that a frame was shown at.
#[derive(Clone, Copy, Debug)]
struct Line {
    present_at: MonoTime,
    delay: MonoSpan,
}

impl ContentClock {
    /// A key has arrived. Lag beyond `lag_limit` is no jitter if it lasts. `reachable` tells the
    /// first refresh at or after a time, if it makes sense to foresee how early the next keys can
    /// be shown.
    pub(super) fn on_key(
        &mut self,
        key: &KeyOffer,
        lag_limit: MonoSpan,
        reachable: impl Fn(MonoTime) -> Option<MonoTime>,
    ) -> KeyTiming {
        let &KeyOffer { content_time, ready_at, first_refresh, is_cut } = key;
        let offer = first_refresh - content_time;
        let went_back = self.newest.is_some_and(|newest| content_time < newest);
        self.newest = Some(content_time);
        let Some(line) = self.line else {
            self.start_anew(first_refresh, offer);
            return KeyTiming::Followed;
        };
        if went_back || offer < line.delay - FORWARD_STEP {
            self.start_anew(first_refresh, offer);
            return KeyTiming::Stepped;
        }
        self.readiness.push(ready_at - content_time);
        let earliest = self.readiness.min().unwrap_or_default() - FORESIGHT;
        let foreseen = reachable(content_time + earliest).map_or(offer, |at| at - content_time);
        self.offers.push(offer.min(foreseen));
        self.target = self.offers.min();
        if is_cut {
            self.line = self.target.map(|delay| Line { present_at: first_refresh, delay });
        }
        self.lagging = if offer > line.delay + lag_limit { self.lagging + 1 } else { 0 };
        if self.lagging < LAGGING_KEYS {
            return KeyTiming::Followed;
        }
        self.offers.keep_newest(LAGGING_KEYS as usize);
        self.readiness.keep_newest(LAGGING_KEYS as usize);
        self.target = self.offers.min();
        self.line = self.target.map(|delay| Line { present_at: first_refresh, delay });
        self.lagging = 0;
        KeyTiming::Relocked
    }

    /// Delay of a frame shown at `present_at`. None before the first key.
    pub(super) fn delay_at(&self, present_at: MonoTime) -> Option<MonoSpan> {
        let (line, target) = (self.line?, self.target?);
        let error = target - line.delay;
        let passed = (present_at - line.present_at).max(MonoSpan::ZERO);
        let fastest = passed.scale(1, FASTEST_SLEW_DIVISOR);
        let slew = error.scale(passed.min(FOLLOW_TIME).as_ns(), FOLLOW_TIME.as_ns());
        Some(line.delay + slew.clamp(-fastest, fastest))
    }

    /// A frame is shown at `present_at` with `delay`: the line goes on from there.
    pub(super) fn go_on_from(&mut self, present_at: MonoTime, delay: MonoSpan) {
        self.line = Some(Line { present_at, delay });
    }

    fn start_anew(&mut self, first_refresh: MonoTime, offer: MonoSpan) {
        self.readiness.clear();
        self.offers.clear();
        self.offers.push(offer);
        self.target = Some(offer);
        self.line = Some(Line { present_at: first_refresh, delay: offer });
        self.lagging = 0;
    }

    pub(super) fn verify_invariants(&self) {
        assert_eq!(self.line.is_some(), self.newest.is_some(), "a line without a key: {self:?}");
        assert_eq!(self.target, self.offers.min(), "a stale target: {self:?}");
        assert!(self.offers.len() <= WINDOW, "window overflow: {}", self.offers.len());
        assert!(self.lagging < LAGGING_KEYS, "a relock was missed: {self:?}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAG_LIMIT: MonoSpan = MonoSpan::from_ms(20);

    fn ms(ms: i64) -> MonoTime {
        MonoTime::ZERO + MonoSpan::from_ms(ms)
    }

    fn take_key(clock: &mut ContentClock, content: i64, refresh: i64, is_cut: bool) -> KeyTiming {
        let (content_time, first_refresh) = (ms(content), ms(refresh));
        let offer = KeyOffer { content_time, ready_at: first_refresh, first_refresh, is_cut };
        clock.on_key(&offer, LAG_LIMIT, |_| None)
    }

    /// Keys every 25 ms whose first refresh is `offers` after their content time.
    fn clock(offers: impl IntoIterator<Item = i64>) -> (ContentClock, Vec<KeyTiming>) {
        let mut clock = ContentClock::default();
        let timings = (10..)
            .zip(offers)
            .map(|(key, offer)| take_key(&mut clock, key * 25, key * 25 + offer, false));
        let timings = timings.collect();
        (clock, timings)
    }

    #[test]
    fn the_delay_follows_the_smallest_offer_without_a_jump() {
        let (mut clock, _) = clock([16, 16, 10]);
        let delays: Vec<i64> = (1..=200)
            .map(|frame| {
                let present_at = ms(320 + frame * 8);
                let delay = clock.delay_at(present_at).unwrap();
                clock.go_on_from(present_at, delay);
                delay.as_ns()
            })
            .collect();
        let steepest = delays.windows(2).map(|pair| pair[0] - pair[1]).max().unwrap();
        assert!(steepest <= 8_000_000 / FASTEST_SLEW_DIVISOR, "{steepest} ns in a frame");
        assert!(delays.is_sorted_by(|a, b| a >= b), "{delays:?}");
        assert!((10_000_000..10_300_000).contains(delays.last().unwrap()), "{delays:?}");
    }

    #[test]
    fn one_late_key_is_forgotten_and_many_move_the_clock_at_once() {
        let late_once = (0..100).map(|key| if key == 50 { 90 } else { 10 });
        let (late, timings) = clock(late_once);
        assert!(timings.iter().all(|&timing| timing == KeyTiming::Followed));
        assert_eq!(late.delay_at(ms(10_000)), Some(MonoSpan::from_ms(10)));
        let (stuck, timings) = clock((0..100).map(|key| if key < 50 { 10 } else { 90 }));
        let relocks = timings.iter().filter(|&&timing| timing == KeyTiming::Relocked);
        assert_eq!(relocks.count(), 1);
        assert_eq!(stuck.delay_at(ms(2_800)), Some(MonoSpan::from_ms(90)));
    }

    #[test]
    fn steps_of_the_application_clock_start_it_anew() {
        let (mut clock, _) = clock([10; 10]);
        let leap = take_key(&mut clock, 1_500, 510, false);
        assert_eq!(leap, KeyTiming::Stepped);
        assert_eq!(clock.delay_at(ms(510)), Some(MonoSpan::from_ms(-990)));
        let back = take_key(&mut clock, 1_499, 535, false);
        assert_eq!(back, KeyTiming::Stepped);
        clock.verify_invariants();
    }

    #[test]
    fn at_a_cut_the_delay_takes_its_target_at_once() {
        let (mut clock, _) = clock([10; 10]);
        take_key(&mut clock, 500, 504, true);
        assert_eq!(clock.delay_at(ms(504)), Some(MonoSpan::from_ms(4)));
    }

    #[test]
    fn an_earlier_refresh_that_comes_into_reach_is_foreseen() {
        // Refreshes every 10 ms from `phase` on, keys every 30 ms, ready 12 to 15 ms later.
        let foreseen = |phase: i64| {
            let mut clock = ContentClock::default();
            for index in 0..20 {
                let content_time = ms(index * 30);
                let ready_at = content_time + MonoSpan::from_ms(if index == 3 { 12 } else { 15 });
                let at_or_after = |time: MonoTime| {
                    let since = (time - ms(phase)).as_ns();
                    ms(phase) + MonoSpan::from_ms(10).scale((since + 9_999_999) / 10_000_000, 1)
                };
                // The key that was early did not come early enough, back then.
                let first_refresh = at_or_after(ready_at.max(content_time + MonoSpan::from_ms(15)));
                let offer = KeyOffer { content_time, ready_at, first_refresh, is_cut: false };
                clock.on_key(&offer, LAG_LIMIT, |time| (index > 3).then(|| at_or_after(time)));
            }
            clock.target.unwrap()
        };
        assert_eq!(foreseen(4), MonoSpan::from_ms(14), "in reach of the early key");
        assert_eq!(foreseen(1), MonoSpan::from_ms(21), "out of reach");
        assert_eq!(foreseen(8), MonoSpan::from_ms(18), "one refresh for all");
    }
}
