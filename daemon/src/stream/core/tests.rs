//! A stream on a clock that is set: what is shown when, and how it is counted.

use std::cell::Cell;
use std::num::NonZeroUsize;

use foreframe_engine::PlaneInput;
use foreframe_engine::format::{
    CameraMotion, MotionConvention, MotionDirection, MotionFormat, MotionUnit,
};

use super::*;

const SIZE: u32 = 16;
/// 100 Hz.
const INTERVAL: MonoSpan = MonoSpan::from_ms(10);

fn at_ms(ms: i64) -> MonoTime {
    MonoTime::ZERO + MonoSpan::from_ms(ms)
}

/// Goes on by a millisecond each time that it is read.
fn tick() -> MonoTime {
    TICKS.with(|ticks| {
        ticks.set(ticks.get() + 1);
        at_ms(ticks.get())
    })
}

thread_local! {
    static TICKS: Cell<i64> = const { Cell::new(0) };
}

/// A stream and the clock that it lives by.
struct Rig {
    core: StreamCore,
    now: MonoTime,
    next_key: u64,
}

impl Rig {
    fn new(method: Method) -> Self {
        Self::with_least_step(method, 0.0)
    }

    fn with_least_step(method: Method, least_step_px: f32) -> Self {
        let format = StreamFormat {
            motion: Some(MotionConvention {
                format: MotionFormat::Rg32f,
                direction: MotionDirection::PreviousToCurrent,
                unit: MotionUnit::Pixels,
                scale: [1.0, 1.0],
                camera_motion: CameraMotion::Included,
            }),
            ..StreamFormat::rgba8(SIZE, SIZE)
        };
        let config = CoreConfig {
            engine: EngineConfig { timer: tick, ..EngineConfig::new(method, NonZeroUsize::MIN) },
            refresh_interval: INTERVAL,
            display_origin: MonoTime::ZERO,
            least_step_px,
        };
        Self { core: StreamCore::new(format, &config), now: MonoTime::ZERO, next_key: 0 }
    }

    /// A key of this content time comes now. It moves by 3 pixels per 40 ms.
    fn key(&mut self, content_ms: i64) {
        let content_time = at_ms(content_ms);
        let color: Vec<u8> = (0..=255_u8).flat_map(|pixel| [pixel; 4]).collect();
        let vector = [3.0_f32, 0.0].map(f32::to_le_bytes).concat();
        let motion = vector.repeat(256);
        let plane =
            |bytes, bytes_per_pixel| PlaneInput::packed(bytes, [SIZE, SIZE], bytes_per_pixel);
        let input = KeyInput {
            index: self.next_key,
            content_time,
            motion_from: Some(content_time - MonoSpan::from_ms(40)),
            is_cut: false,
            color: plane(&color, 4),
            depth: None,
            motion: Some(plane(&motion, 8)),
            mask: None,
            camera: None,
            motion_from_camera: None,
        };
        self.next_key += 1;
        self.core.on_key(&input, || self.now).unwrap();
    }

    /// Waits for the next plan's wake, and makes its picture in `work`.
    fn make_in(&mut self, work: MonoSpan) -> (Plan, FrameOutcome) {
        let plan = self.core.plan(self.now);
        self.now = self.now.max(plan.wake_at);
        let reads = Cell::new(0);
        let (started_at, ready_at) = (self.now, self.now + work);
        let clock = || {
            reads.set(reads.get() + 1);
            if reads.get() == 1 { started_at } else { ready_at }
        };
        let outcome = self.core.make(&plan, clock).expect("there is a key");
        if reads.get() > 0 {
            self.now = ready_at;
        }
        (plan, outcome)
    }

    fn make(&mut self) -> FrameOutcome {
        self.make_in(MonoSpan::from_us(100)).1
    }

    /// Makes every picture whose wake comes before `until`.
    fn make_until(&mut self, until: MonoTime) -> Vec<FrameOutcome> {
        let mut outcomes = Vec::new();
        let is_due = |plan: Plan| plan.content_time.is_some() && plan.wake_at < until;
        while is_due(self.core.plan(self.now)) {
            outcomes.push(self.make());
        }
        self.now = self.now.max(until);
        outcomes
    }

    /// Keys every 40 ms, shown until this one is due.
    fn play(&mut self, keys: i64) {
        for key in 0..keys {
            self.make_until(at_ms(1_000 + 40 * key));
            self.key(1_000 + 40 * key);
        }
    }

    fn pixels(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.core.frame().write_bytes(&mut bytes);
        bytes
    }
}

impl Rig {
    /// The refreshes that are in one of the four counts.
    fn counted(&self) -> u64 {
        let FrameCounts { real, synthesised, repeated, dropped, .. } = self.core.counts();
        real + synthesised + repeated + dropped
    }
}

#[test]
fn before_the_first_key_there_is_nothing_to_show() {
    let mut rig = Rig::new(Method::Linear);
    let plan = rig.core.plan(at_ms(5));
    assert_eq!(plan.content_time, None);
    assert_eq!(rig.core.make(&plan, || at_ms(5)), None);
    assert_eq!(rig.core.counts(), FrameCounts::default());
}

#[test]
fn each_refresh_is_in_exactly_one_count_whatever_happens() {
    let mut rig = Rig::new(Method::Linear);
    rig.play(6);
    let (first, _) = rig.make_in(MonoSpan::from_us(100));
    let before = rig.counted();
    // In time, one refresh too late, three too late, and then a rest until long after easing.
    for work_ms in [1, 11, 1, 35, 1] {
        rig.make_in(MonoSpan::from_ms(work_ms));
    }
    rig.make_until(rig.now + MonoSpan::from_ms(500));
    rig.core.finish(rig.now + MonoSpan::from_ms(123));
    let number = |time: MonoTime| time.as_ns() / INTERVAL.as_ns().unsigned_abs();
    let refreshes = number(rig.now + MonoSpan::from_ms(123)) - number(first.present_at);
    assert_eq!(rig.counted() - before, refreshes, "{:?}", rig.core.counts());
    let counts = rig.core.counts();
    assert!(counts.dropped >= 2, "{counts:?}");
    assert!(counts.repeated > 30 && counts.real > 0 && counts.synthesised > 0, "{counts:?}");
}

#[test]
fn in_betweens_are_left_out_until_something_has_moved_far_enough_and_keys_never_are() {
    // 0.75 pixels a refresh, 4 refreshes a key.
    let made = |least_step_px: f32, key_ms: i64| {
        let mut rig = Rig::with_least_step(Method::Linear, least_step_px);
        rig.play(4);
        let before = rig.core.counts();
        let mut keys = Vec::new();
        for key in 1..21 {
            let key_at = 1_120 + key_ms * key;
            keys.extend(rig.make_until(at_ms(key_at)).into_iter().filter_map(|outcome| {
                let FrameOutcome::Presented(frame) = outcome else { return None };
                Some(frame.key_index)
            }));
            rig.key(key_at);
        }
        keys.dedup();
        assert!(keys.len() >= 20, "{least_step_px}: {keys:?}");
        let after = rig.core.counts();
        assert_eq!(after.dropped, before.dropped, "{least_step_px}");
        after.real + after.synthesised - before.real - before.synthesised
    };
    assert_eq!([0.0, 0.75, 1.4, 100.0].map(|step| made(step, 40)), [80, 80, 40, 20]);
    // A key was skipped each time: motion still spans 40 ms.
    assert_eq!(made(1.4, 80), 80);
}

#[test]
fn a_dropped_refresh_is_not_counted_as_repeated_too() {
    let mut rig = Rig::new(Method::Linear);
    rig.play(6);
    rig.make();
    let before = rig.core.counts();
    let (_, outcome) = rig.make_in(MonoSpan::from_ms(11));
    assert!(matches!(outcome, FrameOutcome::Dropped(_)), "{outcome:?}");
    let FrameOutcome::Presented(next) = rig.make() else { panic!("nothing is shown") };
    let counts = rig.core.counts();
    let passed = next.repeats_before;
    assert_eq!(counts.dropped, before.dropped + 1);
    assert_eq!(counts.repeated, before.repeated + passed - 1, "{passed} refreshes in between");
    assert!(passed >= 1);
}

#[test]
fn a_dropped_picture_tells_what_it_cost_and_what_it_was() {
    let mut rig = Rig::new(Method::Linear);
    rig.play(6);
    rig.make();
    let FrameOutcome::Dropped(dropped) = rig.make_in(MonoSpan::from_ms(11)).1 else {
        panic!("nothing is dropped");
    };
    assert_eq!(dropped.kind, FrameKind::Synthesised);
    assert_eq!(dropped.work, MonoSpan::from_ms(1), "one tick of the engine's clock");
}

#[test]
fn what_is_shown_while_nothing_moves_is_counted_without_waiting_for_the_next_picture() {
    let mut rig = Rig::new(Method::Hold);
    rig.key(1_000);
    let outcomes = rig.make_until(at_ms(200));
    let FrameOutcome::Presented(first) = outcomes[0] else { panic!("{:?}", outcomes[0]) };
    assert!(outcomes[1..].iter().all(|outcome| *outcome == FrameOutcome::Repeated));
    let counts = rig.core.counts();
    assert_eq!((counts.real, counts.repeated), (1, outcomes.len() as u64 - 1));
    // The thread waits for a key alone now; nobody plans, and time goes by.
    rig.core.finish(at_ms(1_000));
    let shown_ms = (at_ms(1_000) - first.presented_at).as_ns() / 1_000_000;
    assert_eq!(rig.core.counts().repeated as i64, shown_ms / 10);
}

#[test]
fn a_late_key_is_eased_into_and_never_runs_back() {
    let mut rig = Rig::new(Method::Linear);
    rig.play(6);
    // The next key is due at 1240 and comes 70 ms late.
    let mut outcomes = rig.make_until(at_ms(1_310));
    rig.key(1_240);
    outcomes.extend(rig.make_until(at_ms(1_340)));
    let content: Vec<_> = outcomes
        .iter()
        .filter_map(|outcome| match outcome {
            FrameOutcome::Presented(frame) => Some(frame.content_time),
            _ => None,
        })
        .collect();
    assert!(content.is_sorted(), "{content:?}");
    assert!(content.len() > 5);
    assert_eq!(rig.core.counts().dropped, 0);
}

#[test]
fn a_dropped_picture_does_not_become_the_one_that_is_compared_with() {
    let mut rig = Rig::new(Method::Hold);
    rig.key(1_000);
    rig.make();
    rig.key(1_040);
    let (_, outcome) = rig.make_in(MonoSpan::from_ms(25));
    assert!(matches!(outcome, FrameOutcome::Dropped(_)), "{outcome:?}");
    // The key has still not been on the display, so it is not a repetition.
    let FrameOutcome::Presented(frame) = rig.make() else { panic!("the key is never shown") };
    assert_eq!((frame.key_index, frame.kind), (1, FrameKind::Real));
}

#[test]
fn blend_calls_a_copied_key_real_and_a_mean_synthesised() {
    let mut rig = Rig::new(Method::Blend);
    rig.play(8);
    for outcome in rig.make_until(at_ms(1_600)) {
        let FrameOutcome::Presented(frame) = outcome else { continue };
        let newest = frame.key_content_time;
        let is_between =
            frame.content_time < newest && frame.content_time > newest - MonoSpan::from_ms(40);
        let expected = if is_between { FrameKind::Synthesised } else { FrameKind::Real };
        assert_eq!(frame.kind, expected, "{frame:?}");
    }
    let core = &rig.core;
    let kind = |content_ms, previous: Option<i64>| {
        let key = NewestKey {
            index: 1,
            content_time: at_ms(1_040),
            previous_content_time: previous.map(at_ms),
            moves: true,
            taken: 2,
        };
        core.kind(at_ms(content_ms), Phase::ZERO, &key)
    };
    for (content_ms, expected) in [
        (990, FrameKind::Real),
        (1_000, FrameKind::Real),
        (1_020, FrameKind::Synthesised),
        (1_040, FrameKind::Real),
        (1_050, FrameKind::Real),
    ] {
        assert_eq!(kind(content_ms, Some(1_000)), expected, "{content_ms} ms between two keys");
        assert_eq!(kind(content_ms, None), FrameKind::Real, "{content_ms} ms, one key");
    }
    // Alone, without a key before it, a key is copied whatever the content time.
    let mut rig = Rig::new(Method::Blend);
    rig.key(1_000);
    let FrameOutcome::Presented(frame) = rig.make() else { panic!("the key is never shown") };
    assert_eq!(frame.kind, FrameKind::Real);
    let key: Vec<u8> = (0..=255_u8).flat_map(|pixel| [pixel; 4]).collect();
    assert_eq!(rig.pixels(), key);
}

/// A stream on a display that tells, with a key that does not move on: eased to a stop.
fn standing() -> Rig {
    let mut rig = Rig::new(Method::Hold);
    rig.core.use_display(Some(INTERVAL));
    rig.now = at_ms(1_000);
    rig.key(1_000);
    rig
}

/// Makes the next picture, hands it over, and hears that it was shown, or not.
fn hand_over(rig: &mut Rig, is_shown: bool) -> FrameOutcome {
    let (plan, outcome) = rig.make_in(MonoSpan::from_us(100));
    if let FrameOutcome::Presented(_) = outcome {
        rig.core.on_handed_over(&plan, rig.now, true);
        let planned = plan.present_at;
        rig.now = rig.now.max(planned);
        rig.core.on_told(match is_shown {
            true => Told::Presented { planned, presented_at: planned, heard_at: rig.now },
            false => Told::Discarded { planned },
        });
    } else {
        rig.now = rig.now.max(plan.present_at);
    }
    outcome
}

#[test]
fn a_picture_that_is_shown_again_for_a_window_that_moved_counts_as_repeated() {
    let mut rig = standing();
    assert!(matches!(hand_over(&mut rig, true), FrameOutcome::Presented(_)), "the key");
    assert_eq!(rig.core.counts().real, 1);
    assert_eq!(hand_over(&mut rig, true), FrameOutcome::Repeated, "nothing has changed");
    let before = rig.core.counts();
    rig.core.on_told(Told::Moved);
    assert!(rig.core.is_to_show_again());
    // Discarded, it is still to be shown, and the display shows the same picture.
    assert!(matches!(hand_over(&mut rig, false), FrameOutcome::Presented(_)));
    assert!(rig.core.is_to_show_again());
    assert!(matches!(hand_over(&mut rig, true), FrameOutcome::Presented(_)));
    assert!(!rig.core.is_to_show_again());
    let after = rig.core.counts();
    assert_eq!((after.real, after.synthesised, after.dropped), (1, 0, before.dropped), "{after:?}");
    assert!(after.repeated >= before.repeated + 2, "{before:?} {after:?}");
    // The control: a key that has come meanwhile is a picture of its own.
    rig.core.on_told(Told::Moved);
    rig.key(1_040);
    assert!(matches!(hand_over(&mut rig, true), FrameOutcome::Presented(_)));
    assert_eq!(rig.core.counts().real, 2);
}

#[test]
fn a_picture_that_was_discarded_counts_when_it_is_shown_at_last() {
    let mut rig = standing();
    hand_over(&mut rig, false);
    let counts = rig.core.counts();
    assert_eq!((counts.real, counts.dropped), (0, 1));
    assert!(rig.core.is_to_show_again());
    hand_over(&mut rig, true);
    let counts = rig.core.counts();
    assert_eq!((counts.real, counts.dropped), (1, 1));
}

#[test]
fn on_a_timer_a_picture_that_was_never_shown_counts_as_dropped() {
    for (method, kind) in
        [(Method::Hold, FrameKind::Real), (Method::Linear, FrameKind::Synthesised)]
    {
        let mut rig = Rig::new(method);
        rig.key(0);
        rig.key(20);
        let shown = loop {
            match rig.make() {
                FrameOutcome::Presented(frame) if frame.kind == kind => break frame,
                _ => {}
            }
        };
        let before = rig.core.counts();
        let pacing = rig.core.pacing();
        rig.core.on_told(Told::Discarded { planned: shown.present_at });
        assert_eq!(rig.core.pacing(), pacing, "it was made in time");
        let after = rig.core.counts();
        let made = |counts: FrameCounts| counts.real + counts.synthesised;
        assert_eq!((made(after) + 1, after.dropped), (made(before), before.dropped + 1));
        // Said twice, or of a picture that nobody made, it changes nothing.
        rig.core.on_told(Told::Discarded { planned: shown.present_at });
        rig.core.on_told(Told::Discarded { planned: at_ms(-1) });
        assert_eq!(rig.core.counts(), after);
        assert!(rig.core.is_to_show_again(), "the display does not have it");
    }
}
