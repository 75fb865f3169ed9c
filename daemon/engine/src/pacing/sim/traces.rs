//! The scenarios of the published table, each with one thing that goes wrong.

use super::{DisplayScript, KeyScript, MissBurst, Policy, Scenario, Stall, StallKind, WorkScript};
use crate::pacing::{PacerConfig, RefreshKind, WorkEstimate};
use crate::time::MonoSpan;

/// A named scenario.
#[derive(Clone, Copy, Debug)]
pub struct Trace {
    /// Short name, unique.
    pub name: &'static str,
    /// What happens, in words.
    pub what: &'static str,
    key_hz: f64,
    refresh_hz: f64,
    change: fn(&mut Scenario),
}

impl Trace {
    /// The scenario, running for `duration` on the chance of `seed`.
    #[must_use]
    pub fn scenario(&self, duration: MonoSpan, seed: u64) -> Scenario {
        let mut scenario = Scenario {
            duration,
            seed,
            keys: KeyScript::steady(MonoSpan::from_hz(self.key_hz)),
            display: DisplayScript {
                drift_ppm: 50,
                timestamp_jitter: MonoSpan::from_us(50),
                feedback_delay: MonoSpan::from_us(100),
                ..DisplayScript::steady(MonoSpan::from_hz(self.refresh_hz))
            },
            work: WorkScript {
                typical: MonoSpan::from_ms(2),
                jitter: MonoSpan::from_us(300),
                spike_per_mille: 0,
            },
        };
        (self.change)(&mut scenario);
        scenario
    }

    /// Our pacer, as a display like that of this trace would be announced to it.
    #[must_use]
    pub fn pacer(&self) -> Policy {
        let display = self.scenario(MonoSpan::ZERO, 0).display;
        // A picture that is ready sooner waits for its refresh; without refreshes it does not.
        let first = match display.kind {
            RefreshKind::Fixed => display.refresh_interval.scale(7, 8),
            RefreshKind::Variable => display.refresh_interval.scale(1, 4),
        };
        Policy::Pacer(PacerConfig {
            refresh_interval: display.refresh_interval,
            refresh: display.kind,
            known_refresh: None,
            interpolates: false,
            work: WorkEstimate::Measured { first },
        })
    }
}

/// Keys that jitter by 30 % of their interval.
fn share_of_interval(scenario: &Scenario) -> MonoSpan {
    scenario.keys.interval.scale(3, 10)
}

const fn trace(
    name: &'static str,
    what: &'static str,
    rates: (f64, f64),
    change: fn(&mut Scenario),
) -> Trace {
    Trace { name, what, key_hz: rates.0, refresh_hz: rates.1, change }
}

/// All of them.
pub const TRACES: [Trace; 21] = [
    trace("even 40 to 120", "nothing goes wrong", (40.0, 120.0), |_| {}),
    trace("even 30 to 48", "a slow display", (30.0, 48.0), |_| {}),
    trace("even 40 to 59.94", "rates that do not divide", (40.0, 59.94), |_| {}),
    trace("even 60 to 119.88", "rates that almost divide", (60.0, 119.88), |_| {}),
    trace("even 45 to 144", "rates that do not divide", (45.0, 144.0), |_| {}),
    trace("even 60 to 240", "a fast display", (60.0, 240.0), |_| {}),
    trace(
        "content jitter",
        "content times off by up to 30 % of a key interval",
        (40.0, 120.0),
        |s| {
            s.keys.content_jitter = share_of_interval(s);
        },
    ),
    trace("arrival jitter", "arrivals off by up to 30 % of a key interval", (40.0, 120.0), |s| {
        s.keys.arrival_jitter = share_of_interval(s);
    }),
    trace("slow clock", "the display runs 200 ppm slow", (50.0, 120.0), |s| {
        s.display.drift_ppm = 200;
    }),
    trace("fast clock", "the display runs 200 ppm fast", (50.0, 120.0), |s| {
        s.display.drift_ppm = -200;
    }),
    trace("skipped refreshes", "2 % of the refreshes show nothing new", (40.0, 120.0), |s| {
        s.display.skipped_per_mille = 20;
    }),
    trace("bursts of misses", "each second nothing new for 40 ms", (40.0, 120.0), |s| {
        let [every, length] = [1_000, 40].map(MonoSpan::from_ms);
        s.display.burst = Some(MissBurst { every, length });
    }),
    trace("late feedback", "feedback after 50 to 80 ms, out of order", (40.0, 120.0), |s| {
        s.display.feedback_delay = MonoSpan::from_ms(50);
        s.display.feedback_jitter = MonoSpan::from_ms(30);
        s.display.feedback_lost_per_mille = 20;
    }),
    trace("no feedback", "the display never answers, 200 ppm slow", (40.0, 120.0), |s| {
        s.display.feedback_lost_per_mille = 1_000;
        s.display.drift_ppm = 200;
    }),
    trace("wrong timestamps", "5 % of them are off by up to half a refresh", (40.0, 120.0), |s| {
        s.display.wrong_per_mille = 50;
    }),
    trace("wrong rate", "60 Hz announced, 39.7 shown, one refresh deep", (30.0, 60.0), |s| {
        s.display.true_interval = Some(MonoSpan::from_hz(39.7));
        s.display.depth = 1;
    }),
    trace(
        "early deadline",
        "the display needs frames 4 ms before its refresh",
        (40.0, 120.0),
        |s| {
            s.display.latch = MonoSpan::from_ms(4);
            s.display.timestamp_jitter = MonoSpan::from_us(500);
        },
    ),
    trace("variable refresh", "to 120 Hz, arrivals off by up to 10 %", (40.0, 120.0), |s| {
        s.display.kind = RefreshKind::Variable;
        s.keys.arrival_jitter = s.keys.interval.scale(1, 10);
    }),
    trace("work spikes", "3 % of the pictures take three times as long", (40.0, 120.0), |s| {
        s.work.spike_per_mille = 30;
    }),
    trace("slow work", "pictures take 6.5 ms of 8.3", (40.0, 120.0), |s| {
        s.work.typical = MonoSpan::from_us(6_500);
    }),
    trace("stalls", "each second the application stops for 150 ms", (40.0, 120.0), |s| {
        let [every, length] = [1_000, 150].map(MonoSpan::from_ms);
        s.keys.stall = Some(Stall { every, length, kind: StallKind::Skipped });
    }),
];
