//! The simulated application: when its keys are about, and when they arrive. The two jitter apart.

use super::rng::SplitMix64;
use crate::time::{MonoSpan, MonoTime};

/// How keys come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct KeyScript {
    /// From key to key.
    pub interval: MonoSpan,
    /// From the content time of a key to its arrival, without jitter.
    pub latency: MonoSpan,
    /// Content times are off the grid by up to this, +-.
    pub content_jitter: MonoSpan,
    /// Arrivals are off the grid by up to this, +-.
    pub arrival_jitter: MonoSpan,
    /// Keys that arrive one whole interval late.
    pub late_per_mille: u32,
    /// Keys that never arrive.
    pub missing_per_mille: u32,
    /// Whether the application starts its frames as the pacer's phase error asks it to.
    pub follows_pacing: bool,
    /// Times at which the application stops for a while.
    pub stall: Option<Stall>,
}

/// The application stops, again and again.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stall {
    /// From the beginning of one stall to that of the next. The first is at half of it.
    pub every: MonoSpan,
    /// How long each lasts.
    pub length: MonoSpan,
    /// What becomes of the keys that were due.
    pub kind: StallKind,
}

/// What becomes of the keys that were due while an application stalled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum StallKind {
    /// They are never rendered.
    Skipped,
    /// They all arrive when the stall ends.
    Queued,
}

impl KeyScript {
    /// Keys exactly every `interval`, arriving one interval after their content time.
    #[must_use]
    pub fn steady(interval: MonoSpan) -> Self {
        Self {
            interval,
            latency: interval,
            content_jitter: MonoSpan::ZERO,
            arrival_jitter: MonoSpan::ZERO,
            late_per_mille: 0,
            missing_per_mille: 0,
            follows_pacing: false,
            stall: None,
        }
    }
}

/// One key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct SimKey {
    pub(super) content_time: MonoTime,
    pub(super) arrived_at: MonoTime,
}

/// The keys of a script, in order of arrival; content times strictly increase.
#[derive(Clone, Debug)]
pub(super) struct KeySource {
    script: KeyScript,
    chance: SplitMix64,
    start: MonoTime,
    ticks: i64,
    /// By how much the application has moved its frames.
    shifted: MonoSpan,
    previous: Option<SimKey>,
    next: SimKey,
}

impl KeySource {
    pub(super) fn new(script: KeyScript, seed: u64, start: MonoTime) -> Self {
        let mut source = Self {
            script,
            chance: SplitMix64::new(seed),
            start,
            ticks: 0,
            shifted: MonoSpan::ZERO,
            previous: None,
            next: SimKey { content_time: start, arrived_at: start },
        };
        source.next = source.make();
        source
    }

    /// The key that arrives next.
    pub(super) fn peek(&self) -> SimKey {
        self.next
    }

    /// Takes the key that arrives next.
    pub(super) fn take_next(&mut self) -> SimKey {
        let next = self.make();
        std::mem::replace(&mut self.next, next)
    }

    pub(super) fn follows(&self) -> bool {
        self.script.follows_pacing
    }

    /// The application starts its frames later by `span`, from the one after the next on.
    pub(super) fn shift(&mut self, span: MonoSpan) {
        self.shifted += span;
    }

    /// The end of the stall that `elapsed` falls into.
    fn stalled_until(&self, elapsed: MonoSpan) -> Option<(MonoSpan, StallKind)> {
        let stall = self.script.stall?;
        let every = stall.every.as_ns().max(1);
        let into = (elapsed.as_ns() - every / 2).rem_euclid(every);
        let left = stall.length - MonoSpan::from_ns(into);
        (left > MonoSpan::ZERO).then(|| (elapsed + left, stall.kind))
    }

    fn make(&mut self) -> SimKey {
        loop {
            let tick = self.script.interval.scale(self.ticks, 1) + self.shifted;
            self.ticks += 1;
            let script = self.script;
            let mut content_time = self.start + tick + self.chance.within(script.content_jitter);
            let jitter = self.chance.within(script.arrival_jitter);
            let mut arrived_at = self.start + tick + script.latency + jitter;
            if self.chance.happens(script.late_per_mille) {
                arrived_at += script.interval;
            }
            let is_missing = self.chance.happens(script.missing_per_mille);
            match self.stalled_until(tick) {
                _ if is_missing => continue,
                Some((_, StallKind::Skipped)) => continue,
                Some((end, StallKind::Queued)) => {
                    arrived_at = arrived_at.max(self.start + end + script.latency);
                }
                None => {}
            }
            if let Some(previous) = self.previous {
                arrived_at = arrived_at.max(previous.arrived_at);
                content_time = content_time.max(previous.content_time + MonoSpan::from_ns(1));
            }
            let key = SimKey { content_time, arrived_at };
            self.previous = Some(key);
            return key;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: MonoTime = MonoTime::ZERO;

    fn keys(script: KeyScript, count: usize) -> Vec<SimKey> {
        let mut source = KeySource::new(script, 3, START);
        (0..count).map(|_| source.take_next()).collect()
    }

    #[test]
    fn jitter_of_content_and_of_arrivals_are_apart() {
        let steady = KeyScript::steady(MonoSpan::from_ms(25));
        let jitter = MonoSpan::from_us(7_500);
        let content = keys(KeyScript { content_jitter: jitter, ..steady }, 500);
        let arrival = keys(KeyScript { arrival_jitter: jitter, ..steady }, 500);
        let spread = |times: Vec<MonoTime>| {
            let off_grid = |(tick, &time): (usize, &MonoTime)| {
                (time - START).as_ns() - 25_000_000 * i64::try_from(tick).unwrap()
            };
            let offsets: Vec<i64> = times.iter().enumerate().map(off_grid).collect();
            offsets.iter().max().unwrap() - offsets.iter().min().unwrap()
        };
        assert!(spread(content.iter().map(|key| key.content_time).collect()) > 14_000_000);
        assert_eq!(spread(content.iter().map(|key| key.arrived_at).collect()), 0);
        assert!(spread(arrival.iter().map(|key| key.arrived_at).collect()) > 14_000_000);
        // The first content time is clamped at the epoch only if jitter reaches below it.
        assert_eq!(spread(arrival.iter().map(|key| key.content_time).collect()), 0);
    }

    #[test]
    fn a_stall_skips_its_keys_or_delivers_them_at_once() {
        let steady = KeyScript::steady(MonoSpan::from_ms(25));
        let stalled = |kind| {
            let stall =
                Stall { every: MonoSpan::from_ms(1_000), length: MonoSpan::from_ms(100), kind };
            keys(KeyScript { stall: Some(stall), ..steady }, 40)
        };
        let longest = |keys: &[SimKey], time: fn(&SimKey) -> MonoTime| {
            keys.windows(2).map(|pair| time(&pair[1]) - time(&pair[0])).max().unwrap()
        };
        let skipped = stalled(StallKind::Skipped);
        assert_eq!(longest(&skipped, |key| key.content_time), MonoSpan::from_ms(125));
        let queued = stalled(StallKind::Queued);
        assert_eq!(longest(&queued, |key| key.content_time), MonoSpan::from_ms(25));
        assert_eq!(longest(&queued, |key| key.arrived_at), MonoSpan::from_ms(125));
    }
}
