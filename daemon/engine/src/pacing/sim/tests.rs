//! What the pacer achieves between simulated applications and displays.

use super::*;
use crate::pacing::{PacerConfig, RefreshKind, WorkEstimate};
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
        refresh: RefreshKind::Fixed,
        known_refresh: None,
        interpolates: false,
        work: WorkEstimate::Measured { first: MonoSpan::from_ms(2) },
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
        assert!(report.steady_judder < 0.01, "{rates}: {report:?}");
        assert_eq!(report.backward_steps, 0, "{rates}");
    });
}

#[test]
fn content_time_is_uniform_while_arrivals_of_keys_jitter() {
    for_all_rates(|mut scenario, rates| {
        scenario.keys.arrival_jitter = scenario.keys.interval.scale(3, 10);
        let report = paced(&scenario);
        assert!(report.steady_judder < 0.01, "{rates}: {report:?}");
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

/// The pacers of others on `trace`.
fn compared(scenario: &Scenario) -> [SimReport; 4] {
    Policy::COMPARED.map(|policy| simulate(scenario, policy))
}

#[test]
fn on_every_trace_no_other_pacer_misses_less_and_ours_is_the_worst_in_nothing() {
    for trace in &TRACES {
        for seed in 1..=3 {
            let scenario = trace.scenario(MonoSpan::from_ms(30_000), seed);
            let ours = simulate(&scenario, trace.pacer());
            let others = compared(&scenario);
            let what = format!("{}, seed {seed}: {ours:?}", trace.name);
            let fewest = others.iter().map(|other| 1.0 - other.on_target).fold(1.0, f64::min);
            // A miss that both have may be one of a frame more or less.
            assert!(1.0 - ours.on_target <= fewest + 5e-5, "{fewest}: {what}");
            let is_beaten = |worse: fn(&SimReport, &SimReport) -> bool| {
                others.iter().any(|other| !worse(&ours, other))
            };
            let ms = MonoSpan::from_ms(1);
            assert!(
                is_beaten(|ours, other| ours.present_error_p50 > other.present_error_p50),
                "{what}"
            );
            assert!(
                is_beaten(|ours, other| ours.present_error_p99 > other.present_error_p99),
                "{what}"
            );
            assert!(
                is_beaten(|ours, other| ours.steady_judder > other.steady_judder + 1e-4),
                "{what}"
            );
            let slack = ms;
            let p50 = others.iter().map(|other| other.latency_p50).max().unwrap();
            let p99 = others.iter().map(|other| other.latency_p99).max().unwrap();
            assert!(ours.latency_p50 <= p50 + slack && ours.latency_p99 <= p99 + slack, "{what}");
        }
    }
}

#[test]
fn on_every_trace_content_never_runs_back_and_no_picture_waits_behind_another() {
    for trace in &TRACES {
        let scenario = trace.scenario(MonoSpan::from_ms(30_000), 1);
        let ours = simulate(&scenario, trace.pacer());
        assert_eq!(ours.backward_steps, 0, "{}", trace.name);
        // A display that needs a refresh more, or most of one, has one picture more under way; of
        // one that does not answer nobody knows when it has taken a picture.
        let needs_long = scenario.display.latch > MonoSpan::from_ms(1);
        let under_way = usize::from(scenario.display.depth) + usize::from(needs_long);
        if scenario.display.feedback_lost_per_mille < 1_000 {
            assert!(ours.longest_queue <= 1 + under_way, "{}: {ours:?}", trace.name);
        }
    }
}

#[test]
fn a_display_that_announces_the_wrong_rate_and_needs_a_refresh_more_is_learned() {
    let trace = TRACES.iter().find(|trace| trace.name == "wrong rate").unwrap();
    let scenario = trace.scenario(MonoSpan::from_ms(30_000), 1);
    let status = simulate(&scenario, trace.pacer()).status.unwrap();
    let truth = MonoSpan::from_hz(39.7);
    assert!(status.is_rate_corrected, "{status:?}");
    assert!((status.refresh_interval - truth).as_ms_f64().abs() < 0.02, "{status:?}");
    assert_eq!(status.display_offset, status.refresh_interval, "{status:?}");
}

#[test]
fn an_application_that_follows_the_phase_error_is_shown_sooner() {
    let mut scenario = scenario(120.0, 40.0);
    let alone = paced(&scenario);
    scenario.keys.follows_pacing = true;
    let follows = paced(&scenario);
    let slack = follows.status.unwrap().slack.unwrap();
    assert!(slack < MonoSpan::from_us(1_200), "{slack:?}");
    // Work, margin, slack and the display's own deadline are what is left.
    let least = MonoSpan::from_us(2_300 + 500 + 500);
    assert!(follows.latency_p50 < least + MonoSpan::from_us(700), "{follows:?}");
    assert!(follows.latency_p50 < alone.latency_p50, "{alone:?}");
}

#[test]
fn an_application_at_the_refresh_rate_gets_no_made_pictures() {
    for key_hz in [60.0, 59.94] {
        let report = paced(&scenario(60.0, key_hz));
        assert!(report.status.unwrap().keeps_up, "{report:?}");
        assert!(report.synthesised < 90, "{key_hz} Hz: {report:?}");
    }
    let report = paced(&scenario(60.0, 55.0));
    assert!(!report.status.unwrap().keeps_up && report.synthesised > 600, "{report:?}");
}
