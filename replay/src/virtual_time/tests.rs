//! Laws of replay, on recordings of which everything is known.

use std::num::NonZeroUsize;

use super::digest::FrameDigester;
use super::keys::{KeyTiming, timed_keys};
use super::*;
use crate::recording::Recording as _;
use crate::recording::keys::KeyReader;
use crate::recording::memory::MemoryRecording;
use crate::recording::plan::Plan;

mod late_camera;
mod ui_plane;

/// What a replay showed.
#[derive(PartialEq, Debug)]
struct Shown {
    frames: Vec<(OutputFrame, String)>,
    digest: String,
    losses: Losses,
}

fn count(n: usize) -> NonZeroUsize {
    NonZeroUsize::new(n).unwrap()
}

fn replayed(recording: &mut MemoryRecording, method: Method, threads: usize) -> Shown {
    replayed_at(recording, method, threads, 120.0, KeyTiming::AsRecorded)
}

fn replayed_at(
    recording: &mut MemoryRecording,
    method: Method,
    threads: usize,
    refresh_hz: f64,
    timing: KeyTiming,
) -> Shown {
    let plan = Plan::new(&recording.heads, count(4));
    replayed_plan(recording, &plan, method, threads, refresh_hz, timing)
}

fn replayed_plan(
    recording: &mut MemoryRecording,
    plan: &Plan,
    method: Method,
    threads: usize,
    refresh_hz: f64,
    timing: KeyTiming,
) -> Shown {
    let reader = KeyReader::new(recording.format(), plan).unwrap();
    let config = ReplayConfig {
        method,
        gpu: None,
        threads: count(threads),
        refresh_interval: MonoSpan::from_hz(refresh_hz),
        display_origin: None,
        pixels_per_degree: None,
        late_cameras: Vec::new(),
        finish: FinishConfig::default(),
        least_step_px: 0.0,
    };
    let mut digester = FrameDigester::default();
    let mut frames = Vec::new();
    let keys = timed_keys(recording, &reader, plan, timing);
    let losses = replay(*reader.format(), &config, keys, [], |frame, picture| {
        frames.push((*frame, digester.add(picture)));
        Ok(())
    })
    .unwrap();
    Shown { frames, digest: digester.all(), losses }
}

fn recording() -> MemoryRecording {
    MemoryRecording::moving_patch(25, [2, 1], &[4])
}

#[test]
fn any_number_of_threads_shows_the_same_frames_twice() {
    for method in Method::ALL {
        let once = replayed(&mut recording(), method, 1);
        for threads in [1, 2, 5] {
            assert_eq!(replayed(&mut recording(), method, threads), once, "{method}, {threads}");
        }
    }
}

#[test]
fn one_changed_pixel_of_one_key_changes_the_digest() {
    let mut changed = recording();
    changed.frames[8].color.bytes[0] ^= 1;
    let [plain, changed] =
        [recording(), changed].map(|mut r| replayed(&mut r, Method::Linear, 1).digest);
    assert_ne!(plain, changed);
}

#[test]
fn every_refresh_shows_one_frame_and_content_time_advances_evenly() {
    let shown = replayed(&mut recording(), Method::Linear, 1);
    assert_eq!(shown.losses, Losses::default());
    let interval = MonoSpan::from_hz(120.0);
    for (index, (frame, _)) in shown.frames.iter().enumerate() {
        assert_eq!(frame.index, index as u64);
        assert_eq!(
            frame.present_at,
            shown.frames[0].0.present_at + interval.scale(index as i64, 1)
        );
    }
    // The clock of the pacer settles on the key interval within the first keys.
    let settled = &shown.frames[8..];
    for pair in settled.windows(2).filter(|pair| pair[1].0.key < 24) {
        let step = pair[1].0.content_time - pair[0].0.content_time;
        let off = (step - interval).as_ns().abs();
        assert!(off < interval.as_ns() / 50, "{step} at {:?}", pair[1].0.present_at);
    }
    assert!(shown.frames.iter().any(|(frame, _)| frame.kind == OutputKind::Synthesised));
    assert!(shown.frames.iter().any(|(frame, _)| frame.kind == OutputKind::Real));
}

#[test]
fn every_key_is_the_newest_of_some_frame_and_none_is_used_before_it_arrives() {
    let mut recording = recording();
    let shown = replayed(&mut recording, Method::Linear, 1);
    let mut keys: Vec<_> = shown.frames.iter().map(|(frame, _)| frame.key).collect();
    for (frame, _) in &shown.frames {
        let arrived_at = recording.heads[frame.key as usize].arrived_at;
        assert!(frame.present_at > arrived_at);
    }
    keys.dedup();
    assert_eq!(keys, [0, 4, 8, 12, 16, 20, 24]);
}

#[test]
fn frames_that_show_a_key_are_the_key_to_the_bit() {
    let recording = recording();
    let shown = replayed(&mut recording.clone(), Method::Linear, 1);
    let reals = shown.frames.iter().filter(|(frame, _)| frame.kind == OutputKind::Real);
    for (frame, digest) in reals {
        let bytes = &recording.frames[frame.key as usize].color.bytes;
        let (texels, _) = bytes.as_chunks::<4>();
        let texels = texels.iter().map(|t| foreframe_engine::color::Rgba8(u32::from_le_bytes(*t)));
        let (width, height) = (recording.format().width, recording.format().height);
        let plane = foreframe_engine::Plane::from_vec(width, height, texels.collect());
        assert_eq!(*digest, FrameDigester::default().add(&ColorPlane::Rgba8(plane)));
    }
}

#[test]
fn stepping_takes_the_jitter_of_the_recording_out() {
    let mut jittered = recording();
    for (frame, head) in jittered.heads.iter_mut().enumerate() {
        head.arrived_at += MonoSpan::from_us(if frame % 8 == 0 { 0 } else { 6_000 });
    }
    let shown = |recording: &mut MemoryRecording, timing| {
        replayed_at(recording, Method::Linear, 1, 120.0, timing)
    };
    let [stepped, plain] = [&mut jittered.clone(), &mut recording()]
        .map(|recording| shown(recording, KeyTiming::Stepped));
    assert_eq!(stepped, plain);
    assert_ne!(shown(&mut jittered, KeyTiming::AsRecorded), plain, "as recorded keeps it");
}

#[test]
fn after_a_lost_key_content_time_never_runs_back_and_soon_advances_evenly_again() {
    // Recorded at the key rate, as a daemon does; the key of frame 12 was lost.
    let mut gap = recording();
    let kept = [0, 4, 8, 16, 20, 24];
    gap.heads = kept.map(|frame| gap.heads[frame].clone()).to_vec();
    gap.frames = kept.map(|frame| gap.frames[frame].clone()).to_vec();
    let plan = Plan::new(&gap.heads, count(1));
    let timing = KeyTiming::AsRecorded;
    let shown = replayed_plan(&mut gap, &plan, Method::Linear, 1, 120.0, timing);
    assert_eq!(shown.losses, Losses::default());
    let contents: Vec<_> = shown.frames.iter().map(|(frame, _)| frame.content_time).collect();
    assert!(contents.is_sorted(), "{contents:?}");
    let after = shown.frames.iter().filter(|(frame, _)| frame.key == 4);
    let times: Vec<_> = after.map(|(frame, _)| frame.content_time).collect();
    let interval = MonoSpan::from_hz(120.0);
    for pair in times.windows(2) {
        assert!(((pair[1] - pair[0]) - interval).as_ns().abs() < interval.as_ns() / 20);
    }
}

#[test]
fn a_key_that_the_engine_refuses_is_reported_and_the_others_are_shown() {
    let mut recording = recording();
    recording.frames[8].color.width -= 1;
    let shown = replayed(&mut recording, Method::Linear, 1);
    assert_eq!(shown.losses.refused.len(), 1);
    assert!(shown.losses.refused[0].starts_with("key 8: "), "{:?}", shown.losses.refused);
    assert!(shown.frames.iter().any(|(frame, _)| frame.key == 24));
}

#[test]
fn refreshes_lie_where_the_recording_says() {
    let mut recording = recording();
    let plan = Plan::new(&recording.heads, count(4));
    let reader = KeyReader::new(recording.format(), &plan).unwrap();
    let first = recording.heads[0].arrived_at;
    let (refresh_interval, before) = (MonoSpan::from_ms(10), MonoSpan::from_ms(3));
    for (display_origin, expected) in [(None, 0), (Some(first - before), 7_000_000)] {
        let config = ReplayConfig {
            method: Method::Hold,
            gpu: None,
            threads: count(1),
            refresh_interval,
            display_origin,
            pixels_per_degree: None,
            late_cameras: Vec::new(),
            finish: FinishConfig::default(),
            least_step_px: 0.0,
        };
        let keys = timed_keys(&mut recording, &reader, &plan, KeyTiming::AsRecorded);
        let mut shown = 0;
        let losses = replay(*reader.format(), &config, keys, [], |frame, _| {
            let after = (frame.present_at - first).as_ns();
            assert_eq!(after % refresh_interval.as_ns(), expected, "{display_origin:?}");
            shown += 1;
            Ok(())
        });
        assert_eq!(losses.unwrap().refused, [""; 0]);
        assert!(shown > 5, "{shown}");
    }
}

#[test]
fn an_error_of_the_sink_ends_the_replay() {
    let mut recording = recording();
    let plan = Plan::new(&recording.heads, count(4));
    let reader = KeyReader::new(recording.format(), &plan).unwrap();
    let config = ReplayConfig {
        method: Method::Hold,
        gpu: None,
        threads: count(1),
        refresh_interval: MonoSpan::from_hz(60.0),
        display_origin: None,
        pixels_per_degree: None,
        late_cameras: Vec::new(),
        finish: FinishConfig::default(),
        least_step_px: 0.0,
    };
    let keys = timed_keys(&mut recording, &reader, &plan, KeyTiming::Stepped);
    let result = replay(*reader.format(), &config, keys, [], |_, _| anyhow::bail!("disk full"));
    assert!(result.unwrap_err().to_string().contains("disk full"));
}

#[test]
fn one_key_alone_is_shown() {
    let mut recording = MemoryRecording::moving_patch(1, [2, 1], &[4]);
    let shown = replayed(&mut recording, Method::Linear, 1);
    assert!(shown.frames.iter().any(|(frame, _)| frame.kind == OutputKind::Real));
    assert_eq!(
        replayed(&mut MemoryRecording::moving_patch(0, [2, 1], &[4]), Method::Linear, 1).frames,
        []
    );
}

#[test]
fn what_is_repeated_is_the_picture_that_was_shown_and_not_one_that_was_dropped() {
    let mut recording = recording();
    let plan = Plan::new(&recording.heads, count(4));
    let reader = KeyReader::new(recording.format(), &plan).unwrap();
    let config = ReplayConfig {
        method: Method::Hold,
        gpu: None,
        threads: count(1),
        refresh_interval: MonoSpan::from_hz(100.0),
        display_origin: None,
        pixels_per_degree: None,
        late_cameras: Vec::new(),
        finish: FinishConfig::default(),
        least_step_px: 0.0,
    };
    let keys = timed_keys(&mut recording, &reader, &plan, KeyTiming::Stepped);
    let keys: Vec<_> = keys.map(Result::unwrap).take(2).collect();
    let mut stream = VirtualStream::new(*reader.format(), &config, keys[0].arrives_at);
    let mut now = keys[0].arrives_at;
    let mut make = |stream: &mut VirtualStream, key: &TimedKey, late: MonoSpan| {
        stream.core.on_key(&key.frame.as_input(), || key.arrives_at).unwrap();
        now = now.max(key.arrives_at);
        let plan = stream.core.plan(now);
        let ready_at = plan.wake_at + late;
        let outcome = stream.core.make(&plan, || ready_at).unwrap();
        now = ready_at;
        (stream.on_outcome(outcome, plan.present_at), plan.present_at)
    };
    let (shown, _) = make(&mut stream, &keys[0], MonoSpan::ZERO);
    assert_eq!(shown.unwrap().kind, OutputKind::Real);
    let first = stream.picture.clone();
    let (dropped, present_at) = make(&mut stream, &keys[1], MonoSpan::from_ms(100));
    assert_eq!(dropped, None);
    assert_ne!(*stream.core.frame(), first, "the dropped picture is another one");
    let repeated = stream.on_outcome(FrameOutcome::Repeated, present_at).unwrap();
    assert_eq!((repeated.kind, repeated.key), (OutputKind::Repeated, 0));
    assert_eq!(stream.picture, first);
}

#[test]
fn keys_that_outrun_the_display_are_superseded_by_the_newest_that_is_in_time() {
    // A key every 8.3 ms of the recording, on a display of 40 Hz.
    let mut recording = recording();
    let plan = Plan::new(&recording.heads, count(1));
    let timing = KeyTiming::AsRecorded;
    let shown = replayed_plan(&mut recording, &plan, Method::Hold, 1, 40.0, timing);
    assert_eq!(shown.losses.dropped, 0);
    // Three keys come per refresh, the third of them 8.3 ms before it: the picture, which is made a
    // millisecond or two before its refresh, shows that one. The last key comes at a refresh, so it
    // waits for the next.
    let interval = MonoSpan::from_ms(25);
    let first_at = recording.heads[0].arrived_at;
    let expected = [2, 5, 8, 11, 14, 17, 20, 23, 24];
    assert_eq!(expected.len() as u64 + shown.losses.superseded, plan.keys.len() as u64);
    let mut shown = shown.frames.iter().map(|(frame, _)| frame);
    for (refresh, key) in (1..).zip(expected) {
        let frame = shown.next().unwrap();
        let found = (frame.key, frame.kind, frame.present_at);
        assert_eq!(found, (key, OutputKind::Real, first_at + interval.scale(refresh, 1)));
    }
    assert!(shown.all(|frame| (frame.key, frame.kind) == (24, OutputKind::Repeated)));
}
