//! What a stream's thread notices about itself, for people: latencies by stage, headroom, rates.
//!
//! Fixed memory, a few additions per picture; percentiles are worked out only when a report is due.

use foreframe_engine::{MonoSpan, MonoTime};
use foreframe_protocol::ValidRectUse;

use super::core::FrameCounts;
use crate::control::{Rates, Spread, Stages};

/// Values that a spread is made of.
const KEPT: usize = 128;
/// Upper bounds of the classes of headroom but the last, milliseconds.
const HEADROOM_MS: [f64; 5] = [0.0, 1.0, 2.0, 4.0, 8.0];

/// Keys per second from which on full and reduced ones in turn are seen as one picture (Denes 2020,
/// section 5.2.1).
const FUSED_HZ: f64 = 90.0;
/// A measured rate may be that much lower.
const RATE_ERROR: f64 = 0.05;

/// What is to be said of a stream whose full and reduced keys can be told apart.
#[must_use]
pub fn alternation(valid_rect_use: ValidRectUse, keys_hz: f64) -> Option<String> {
    let is_seen = keys_hz > 0.0 && keys_hz < FUSED_HZ * (1.0 - RATE_ERROR);
    (valid_rect_use == ValidRectUse::Multiplex && is_seen).then(|| {
        format!(
            "full and reduced keys are seen to alternate at {:.0} Hz: expected {FUSED_HZ} keys a \
             second or more, found {keys_hz:.0}",
            keys_hz / 2.0
        )
    })
}

/// The last values of a duration.
#[derive(Clone, Debug)]
struct Recent {
    ms: [f32; KEPT],
    added: usize,
}

impl Default for Recent {
    fn default() -> Self {
        Self { ms: [0.0; KEPT], added: 0 }
    }
}

impl Recent {
    #[expect(clippy::cast_possible_truncation, reason = "milliseconds for people to read")]
    fn add(&mut self, span: MonoSpan) {
        self.ms[self.added % KEPT] = span.as_ms_f64() as f32;
        self.added += 1;
    }

    fn values(&self) -> &[f32] {
        &self.ms[..self.added.min(KEPT)]
    }

    fn spread(&self) -> Spread {
        let mut sorted = self.values().to_vec();
        sorted.sort_by(f32::total_cmp);
        let at = |percent: usize| {
            let index = (sorted.len().saturating_sub(1) * percent).div_ceil(100);
            sorted.get(index).copied().map_or(0.0, f64::from)
        };
        Spread { p50: at(50), p95: at(95) }
    }
}

/// The instants of one key, from its arrival to the picture that first shows it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct KeyInstants {
    /// At the main loop.
    pub arrived_at: MonoTime,
    /// Its thread turned to it.
    pub latched_at: MonoTime,
    /// It can be shown.
    pub taken_in_at: MonoTime,
}

/// The instants of the picture that first shows a key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PictureInstants {
    /// Its wake had come.
    pub begun_at: MonoTime,
    /// It was made.
    pub ready_at: MonoTime,
    /// The display has it.
    pub handed_over_at: MonoTime,
    /// The refresh that shows it.
    pub presented_at: MonoTime,
}

/// What was noticed so far.
#[derive(Clone, Debug, Default)]
pub struct Observed {
    waited: Recent,
    taken_in: Recent,
    made: Recent,
    paced: Recent,
    handed_over: Recent,
    until_shown: Recent,
    whole: Recent,
    synthesis: Recent,
    headroom: Recent,
    /// Of the report before, and when it was.
    reported: Option<(MonoTime, FrameCounts)>,
}

impl Observed {
    /// A key is shown for the first time, by this picture.
    pub fn key_shown(&mut self, key: &KeyInstants, picture: &PictureInstants) {
        let PictureInstants { begun_at, ready_at, handed_over_at, presented_at } = *picture;
        self.waited.add(key.latched_at - key.arrived_at);
        self.taken_in.add(key.taken_in_at - key.latched_at);
        self.made.add(ready_at - key.taken_in_at);
        self.paced.add(begun_at - key.taken_in_at);
        self.handed_over.add(handed_over_at - key.arrived_at);
        self.until_shown.add(presented_at - ready_at);
        self.whole.add(presented_at - key.arrived_at);
    }

    /// A picture was ready at `ready_at` for the refresh at `present_at`.
    pub fn picture(&mut self, ready_at: MonoTime, present_at: MonoTime) {
        self.headroom.add(present_at - ready_at);
    }

    /// The engine took `work` for an in-between frame.
    pub fn synthesised(&mut self, work: MonoSpan) {
        self.synthesis.add(work);
    }

    /// Where the time of keys goes.
    #[must_use]
    pub fn stages(&self) -> Stages {
        Stages {
            waited: self.waited.spread(),
            taken_in: self.taken_in.spread(),
            made: self.made.spread(),
            paced: self.paced.spread(),
            handed_over: self.handed_over.spread(),
            until_shown: self.until_shown.spread(),
            whole: self.whole.spread(),
            synthesis: self.synthesis.spread(),
        }
    }

    /// How many of the last pictures were ready how long before their refresh.
    #[must_use]
    pub fn headroom(&self) -> [u32; 6] {
        let mut classes = [0; 6];
        for &ms in self.headroom.values() {
            let class = HEADROOM_MS.iter().position(|&below| f64::from(ms) < below);
            classes[class.unwrap_or(HEADROOM_MS.len())] += 1;
        }
        classes
    }

    /// Per second since the report before, and the share of pictures on target, percent. To be
    /// called once per report.
    pub fn rates(&mut self, now: MonoTime, counts: FrameCounts) -> (Rates, f64) {
        let before = self.reported.replace((now, counts));
        let Some((then, before)) = before else { return (Rates::default(), 100.0) };
        let seconds = (now - then).as_ms_f64().max(1e-3) / 1e3;
        let per_second = |now: u64, before: u64| now.saturating_sub(before) as f64 / seconds;
        let rates = Rates {
            keys: per_second(counts.keys, before.keys),
            real: per_second(counts.real, before.real),
            synthesised: per_second(counts.synthesised, before.synthesised),
            repeated: per_second(counts.repeated, before.repeated),
            dropped: per_second(counts.dropped, before.dropped),
        };
        let shown = rates.real + rates.synthesised;
        let planned = shown + rates.dropped;
        (rates, if planned > 0.0 { 100.0 * shown / planned } else { 100.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_ms(ms: i64) -> MonoTime {
        MonoTime::ZERO + MonoSpan::from_ms(ms)
    }

    #[test]
    fn only_slow_multiplexing_alternates_visibly() {
        assert_eq!(alternation(ValidRectUse::Multiplex, 89.0), None);
        assert_eq!(alternation(ValidRectUse::Multiplex, 0.0), None, "no keys at all");
        assert_eq!(alternation(ValidRectUse::Stretch, 60.0), None);
        let said = alternation(ValidRectUse::Multiplex, 60.0).unwrap();
        assert!(said.contains("at 30 Hz") && said.contains("found 60"), "{said}");
    }

    #[test]
    fn a_spread_forgets_what_is_long_ago() {
        let mut recent = Recent::default();
        assert_eq!(recent.spread(), Spread::default());
        recent.add(MonoSpan::from_ms(1000));
        assert_eq!(recent.spread(), Spread { p50: 1000.0, p95: 1000.0 });
        for ms in 0..KEPT as i64 {
            recent.add(MonoSpan::from_ms(ms));
        }
        assert_eq!(recent.spread(), Spread { p50: 64.0, p95: 121.0 });
    }

    #[test]
    fn the_stages_of_a_key_add_up() {
        let mut observed = Observed::default();
        let [arrived_at, latched_at, taken_in_at] = [100, 101, 104].map(at_ms);
        let key = KeyInstants { arrived_at, latched_at, taken_in_at };
        let [begun_at, ready_at, handed_over_at, presented_at] = [107, 110, 112, 117].map(at_ms);
        observed
            .key_shown(&key, &PictureInstants { begun_at, ready_at, handed_over_at, presented_at });
        let stages = observed.stages();
        assert_eq!((stages.paced.p50, stages.handed_over.p50), (3.0, 12.0));
        let parts = [stages.waited, stages.taken_in, stages.made, stages.until_shown];
        assert_eq!(parts.map(|part| part.p50), [1.0, 3.0, 6.0, 7.0]);
        assert!((parts.iter().map(|part| part.p50).sum::<f64>() - stages.whole.p50).abs() < 1e-9);
    }

    #[test]
    fn headroom_is_counted_in_classes_and_late_ones_apart() {
        let mut observed = Observed::default();
        for (ready, present) in [(10, 9), (10, 10), (10, 11), (10, 13), (10, 17), (10, 100)] {
            observed.picture(at_ms(ready), at_ms(present));
        }
        assert_eq!(observed.headroom(), [1, 1, 1, 1, 1, 1]);
    }

    #[test]
    fn rates_are_those_since_the_report_before() {
        let mut observed = Observed::default();
        let counts = |real, synthesised, dropped| FrameCounts {
            keys: real,
            real,
            synthesised,
            repeated: 0,
            dropped,
        };
        assert_eq!(observed.rates(at_ms(0), counts(4, 8, 1)), (Rates::default(), 100.0));
        let (rates, on_target) = observed.rates(at_ms(500), counts(24, 68, 21));
        assert_eq!(
            (rates.keys, rates.real, rates.synthesised, rates.dropped),
            (40., 40., 120., 40.)
        );
        assert!((on_target - 80.0).abs() < 1e-9);
    }
}
