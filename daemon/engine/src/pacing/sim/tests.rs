//! What the pacer achieves between simulated applications and displays.

use super::*;
use crate::pacing::{PacerConfig, WorkEstimate};
use crate::time::MonoSpan;

const REFRESH_HZ: [f64; 5] = [60.0, 72.0, 120.0, 144.0, 240.0];
const KEY_HZ: [f64; 4] = [40.0, 45.0, 50.0, 60.0];

/// An application and a display that are as good as real ones get.
fn scenario(refresh_hz: f64, key_hz: f64) -> Scenario {
    Scenario {
        duration: MonoSpan::from_ms(30_000),
        seed: 1,
        keys: KeyScript::steady(MonoSpan::from_hz(key_hz)),
        display: DisplayScript {
            drift_ppm: 50,
            timestamp_jitter: MonoSpan::from_us(50),
            ..DisplayScript::steady(MonoSpan::from_hz(refresh_hz))
        },
        work: WorkScript {
            typical: MonoSpan::from_ms(2),
            jitter: MonoSpan::from_us(300),
            spike_per_mille: 0,
        },
    }
}

fn paced(scenario: &Scenario) -> SimReport {
    let config = PacerConfig {
        refresh_interval: scenario.display.refresh_interval,
        known_refresh: None,
        interpolates: false,
        work: WorkEstimate::Measured,
    };
    simulate(scenario, Policy::Pacer(config))
}

fn for_all_rates(mut check: impl FnMut(Scenario, &str)) {
    for refresh_hz in REFRESH_HZ {
        for key_hz in KEY_HZ {
            check(scenario(refresh_hz, key_hz), &format!("{key_hz} to {refresh_hz} Hz"));
        }
    }
}

#[test]
fn content_time_is_uniform_while_content_times_of_keys_jitter() {
    for_all_rates(|mut scenario, rates| {
        scenario.keys.content_jitter = scenario.keys.interval.scale(3, 10);
        let report = paced(&scenario);
        assert!(report.content_judder < 0.02, "{rates}: {report:?}");
        assert_eq!(report.backward_steps, 0, "{rates}");
    });
}

#[test]
fn content_time_is_uniform_while_arrivals_of_keys_jitter() {
    for_all_rates(|mut scenario, rates| {
        scenario.keys.arrival_jitter = scenario.keys.interval.scale(3, 10);
        let report = paced(&scenario);
        assert!(report.content_judder < 0.02, "{rates}: {report:?}");
        assert_eq!(report.backward_steps, 0, "{rates}");
    });
}

#[test]
fn a_plain_timer_judders_where_the_pacer_does_not() {
    let mut scenario = scenario(120.0, 40.0);
    scenario.keys.content_jitter = scenario.keys.interval.scale(3, 10);
    let timer = simulate(&scenario, Policy::NaiveTimer);
    assert!(timer.content_judder > 0.1, "{timer:?}");
    assert!(paced(&scenario).content_judder < timer.content_judder / 10.0);
}

#[test]
fn even_keys_are_shown_as_they_are_and_two_frames_are_made_between_them() {
    let report = paced(&scenario(120.0, 40.0));
    assert!(report.real >= report.keys_shown - 1, "{report:?}");
    assert!(report.synthesised.abs_diff(2 * report.real) <= 3, "{report:?}");
    assert_eq!(report.repeated, 0, "{report:?}");
}

#[test]
fn every_key_is_shown_at_the_first_refresh_that_it_can_reach() {
    for_all_rates(|mut scenario, rates| {
        scenario.keys.arrival_jitter = scenario.keys.interval.scale(3, 10);
        let report = paced(&scenario);
        // Work, margin and one refresh: the next refresh always comes within that.
        let longest = scenario.display.refresh_interval + MonoSpan::from_us(2_300 + 600);
        assert!(report.latency_p99 <= longest, "{rates}: {report:?}");
    });
}
