//! Schedules to read: which refresh shows which key at which phase.

use std::fmt::Write as _;

use crate::Phase;
use crate::pacing::{Pacer, PacerConfig, RefreshKind, WorkEstimate};
use crate::time::{MonoSpan, MonoTime};

/// From the content time of a key to its arrival, in microseconds.
const LATENCY_US: i64 = 10_000;

fn at(us: i64) -> MonoTime {
    MonoTime::ZERO + MonoSpan::from_us(us)
}

/// The plans of a 120 Hz display without feedback (refreshes every 8.333 ms from 0 on, 2 ms of
/// work) that are started between `from` and `to` (us), as a table. `keys`: content time and
/// arrival, us. Phases are relative to `interval_us`.
fn schedule(keys: &[(i64, i64)], interval_us: i64, from: i64, to: i64) -> String {
    let mut pacer = Pacer::new(PacerConfig {
        refresh_interval: MonoSpan::from_hz(120.0),
        refresh: RefreshKind::Fixed,
        known_refresh: Some(MonoTime::ZERO),
        interpolates: false,
        work: WorkEstimate::Constant(MonoSpan::from_ms(2)),
    });
    let mut keys = keys.iter().copied().peekable();
    let mut newest = 0;
    let mut now = at(0);
    let mut table = String::from("wake present content key phase\n");
    loop {
        let plan = pacer.plan(now);
        if let Some((content, arrival)) = keys.next_if(|&(_, arrival)| at(arrival) <= plan.wake_at)
        {
            now = now.max(at(arrival));
            newest = content;
            pacer.on_key(at(content), at(arrival), false);
            continue;
        }
        if plan.wake_at > at(to) {
            return table;
        }
        now = plan.wake_at;
        pacer.start(&plan);
        if let (true, Some(content)) = (now >= at(from), plan.content_time) {
            let phase = Phase::at(content, at(newest), MonoSpan::from_us(interval_us)).as_f64();
            let ms = |time: MonoTime| (time - MonoTime::ZERO).as_ms_f64();
            let (wake, present) = (ms(plan.wake_at), ms(plan.present_at));
            let key = newest / 1_000;
            writeln!(table, "{wake:.3} {present:.3} {:.3} {key} {phase:.3}", ms(content))
                .expect("a string takes everything");
        }
    }
}

/// Compares line by line, without the indentation of the literal.
#[track_caller]
fn assert_schedule(found: &str, expected: &str) {
    let lines = |table: &str| table.lines().map(str::trim).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(lines(found.trim()), lines(expected.trim()), "found:\n{found}");
}

fn even_keys(count: i64) -> Vec<(i64, i64)> {
    (0..count).map(|key| (key * 25_000, key * 25_000 + LATENCY_US)).collect()
}

#[test]
fn at_40_to_120_hz_each_key_is_shown_and_followed_by_a_third_and_two_thirds() {
    let table = schedule(&even_keys(20), 25_000, 200_000, 258_000);
    assert_schedule(
        &table,
        "
         wake present content key phase
         205.833 208.333 191.667 175 0.667
         214.167 216.667 200.000 200 0.000
         222.500 225.000 208.333 200 0.333
         230.833 233.333 216.667 200 0.667
         239.167 241.667 225.000 225 0.000
         247.500 250.000 233.333 225 0.333
         255.833 258.333 241.667 225 0.667
        ",
    );
}

#[test]
fn a_late_key_lets_motion_come_to_rest_and_is_followed_at_once() {
    let mut keys = even_keys(20);
    keys[10].1 += 60_000;
    keys[11].1 = keys[10].1;
    keys[12].1 = keys[10].1;
    let table = schedule(&keys, 25_000, 240_000, 345_000);
    assert_schedule(
        &table,
        "
         wake present content key phase
         247.500 250.000 233.333 225 0.333
         255.833 258.333 241.667 225 0.667
         264.167 266.667 250.000 225 1.000
         272.500 275.000 257.639 225 1.306
         280.833 283.333 263.889 225 1.556
         289.167 291.667 268.750 225 1.750
         297.500 300.000 272.222 225 1.889
         305.833 308.333 274.306 225 1.972
         314.167 316.667 275.000 225 2.000
         322.500 325.000 308.333 300 0.333
         330.833 333.333 316.667 300 0.667
         339.167 341.667 325.000 325 0.000
        ",
    );
}

#[test]
fn content_times_that_jitter_move_phases_and_not_content_time() {
    let mut keys = even_keys(40);
    for (index, key) in keys.iter_mut().enumerate() {
        key.0 += [0, 6_000, -6_000][index % 3];
    }
    let table = schedule(&keys, 25_000, 800_000, 870_000);
    assert_schedule(
        &table,
        "
         wake present content key phase
         805.833 808.333 797.667 781 0.667
         814.167 816.667 806.000 794 0.480
         822.500 825.000 814.333 794 0.813
         830.833 833.333 822.667 794 1.147
         837.083 841.667 831.000 825 0.240
         847.500 850.000 839.333 825 0.573
         855.833 858.333 847.667 825 0.907
         864.167 866.667 856.000 856 0.000
        ",
    );
}
