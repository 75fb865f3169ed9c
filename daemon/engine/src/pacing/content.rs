//! Maps present time to content time: content time = present time - delay, one smooth line.
//!
//! Each key offers a delay: the first refresh that can show it minus its content time. The
//! smallest offer in a window is the delay at which no key is shown at a negative phase, and at
//! which the best-placed keys are shown as they are, at phase 0. The line never jumps to it: the
//! delay slews, so that keys with uneven content times, and keys that arrive unevenly, move the
//! line by a fraction of a percent of its velocity.
//!
//! Two things make it jump, both counted: the application's clock steps (content times run
//! backwards, or leap ahead), or keys stay behind for so long that it is no jitter.

use super::recent::Recent;
use crate::time::{MonoSpan, MonoTime};

/// Keys that the delay looks back on: 3 s at 40 Hz. Shorter and the minimum wanders with jitter,
/// longer and extrapolation stays needlessly long after an early key.
const WINDOW: usize = 128;
/// Time constant with which the delay follows a smaller offer.
const TIGHTEN_TIME: MonoSpan = MonoSpan::from_ms(500);
/// Time constant with which it is released when small offers have left the window. Slow: the next
/// one makes content time jump by what was released.
const RELEASE_TIME: MonoSpan = MonoSpan::from_ms(4_000);
/// It changes by at most 1/32 of the time that passes: velocity on the screen stays within 3 %.
const FASTEST_SLEW_DIVISOR: i64 = 32;
/// Content time that leaps ahead by more was set, not jittered.
const FORWARD_STEP: MonoSpan = MonoSpan::from_ms(250);
/// So many keys in a row that lag by [`LAG_INTERVALS`] have a new delay.
const LAGGING_KEYS: u32 = 8;
/// Lag, in key intervals, that the slew alone would take too long to follow.
const LAG_INTERVALS: i64 = 2;

/// What a key meant for the clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum KeyTiming {
    /// It moved the clock at most slowly.
    Followed,
    /// The application's clock was stepped; content time starts anew from this key.
    Stepped,
    /// Keys have fallen behind for good; the clock follows them, content time goes on.
    Relocked,
}

/// The mapping.
#[derive(Clone, Debug, Default)]
pub(super) struct ContentClock {
    newest: Option<MonoTime>,
    offers: Recent<WINDOW>,
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
    /// A key has arrived that `first_refresh` is the first to show. `interval` is the usual time
    /// from key to key, if known; a cut lets the line jump, for nobody can see it.
    pub(super) fn on_key(
        &mut self,
        content_time: MonoTime,
        first_refresh: MonoTime,
        interval: Option<MonoSpan>,
        is_cut: bool,
    ) -> KeyTiming {
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
        self.offers.push(offer);
        self.target = self.offers.min();
        if is_cut {
            self.line = self.target.map(|delay| Line { present_at: first_refresh, delay });
        }
        let limit = interval.map_or(FORWARD_STEP, |interval| interval.scale(LAG_INTERVALS, 1));
        self.lagging = if offer > line.delay + limit { self.lagging + 1 } else { 0 };
        if self.lagging < LAGGING_KEYS {
            return KeyTiming::Followed;
        }
        self.offers.keep_newest(LAGGING_KEYS as usize);
        self.target = self.offers.min();
        self.lagging = 0;
        KeyTiming::Relocked
    }

    /// Delay of a frame shown at `present_at`. None before the first key.
    pub(super) fn delay_at(&self, present_at: MonoTime) -> Option<MonoSpan> {
        let (line, target) = (self.line?, self.target?);
        let error = target - line.delay;
        let passed = (present_at - line.present_at).max(MonoSpan::ZERO);
        let fastest = passed.scale(1, FASTEST_SLEW_DIVISOR);
        let time = if error < MonoSpan::ZERO { TIGHTEN_TIME } else { RELEASE_TIME };
        let slew = error.scale(passed.min(time).as_ns(), time.as_ns());
        Some(line.delay + slew.clamp(-fastest, fastest))
    }

    /// A frame is shown at `present_at` with `delay`: the line goes on from there.
    pub(super) fn go_on_from(&mut self, present_at: MonoTime, delay: MonoSpan) {
        self.line = Some(Line { present_at, delay });
    }

    fn start_anew(&mut self, first_refresh: MonoTime, offer: MonoSpan) {
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
