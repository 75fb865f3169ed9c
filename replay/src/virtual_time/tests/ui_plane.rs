//! User interfaces that come between keys.

use foreframe_engine::Rect;

use super::*;
use crate::recording::OwnedPlane;

/// One pixel of this colour in the top left corner.
fn ui(arrives_at: MonoTime, color: [u8; 4]) -> TimedUi {
    let plane = OwnedPlane {
        bytes: color.to_vec(),
        width: 1,
        height: 1,
        stride: 4,
        valid: Rect::full(1, 1),
        jitter: [0.0; 2],
    };
    TimedUi { arrives_at, place: [0; 2], plane }
}

/// Output frames with the first pixel of each, and the digest of all.
fn shown(uis: Vec<TimedUi>, threads: usize) -> (Vec<(OutputFrame, [u8; 4])>, String) {
    let mut recording = MemoryRecording::moving_patch(25, [0, 0], &[4]);
    let plan = Plan::new(&recording.heads, count(4));
    let reader = KeyReader::new(recording.format(), &plan).unwrap();
    let config = ReplayConfig {
        method: Method::Linear,
        gpu: None,
        threads: count(threads),
        refresh_interval: MonoSpan::from_hz(120.0),
        display_origin: None,
        pixels_per_degree: None,
        late_cameras: Vec::new(),
        finish: FinishConfig::default(),
        least_step_px: 0.0,
    };
    let keys = timed_keys(&mut recording, &reader, &plan, KeyTiming::AsRecorded);
    let (mut digester, mut frames) = (FrameDigester::default(), Vec::new());
    let uis = uis.into_iter().map(Ok);
    replay(*reader.format(), &config, keys, uis, |frame, picture| {
        digester.add(picture);
        let mut bytes = Vec::new();
        picture.write_bytes(&mut bytes);
        frames.push((*frame, bytes[..4].try_into().unwrap()));
        Ok(())
    })
    .unwrap();
    (frames, digester.all())
}

#[test]
fn it_is_shown_from_the_first_picture_after_it_arrived_and_newest_wins() {
    let heads = recording().heads;
    let (plain, _) = shown(Vec::new(), 1);
    let arrives_at = heads[12].arrived_at + MonoSpan::from_ms(3);
    let red = [255, 0, 0, 255];
    // The second comes with the first: that one is never seen.
    let uis = vec![ui(arrives_at, [9; 4]), ui(arrives_at, red)];
    let (led, digest) = shown(uis.clone(), 1);
    assert_eq!(led.len(), plain.len());
    let mut seen = 0;
    for ((frame, pixel), (_, before)) in led.iter().zip(&plain) {
        let is_later = frame.present_at > arrives_at + MonoSpan::from_hz(120.0);
        let is_earlier = frame.present_at <= arrives_at;
        assert!(!is_later || *pixel == red, "{frame:?}");
        assert!(!is_earlier || pixel == before, "{frame:?}");
        seen += usize::from(*pixel == red);
    }
    assert!(seen > 0 && seen < led.len());
    for threads in [2, 5] {
        assert_eq!(shown(uis.clone(), threads), (led.clone(), digest.clone()));
    }
}

#[test]
fn it_changes_at_every_refresh_of_a_picture_that_stands_still_and_after_the_last_key() {
    let last = recording().heads.last().unwrap().arrived_at;
    let refresh = MonoSpan::from_hz(120.0);
    let at = |i: i64| last + MonoSpan::from_ms(200) + refresh.scale(i, 1);
    let uis: Vec<_> = (0..10_u8).map(|i| ui(at(i64::from(i)), [i, 0, 0, 255])).collect();
    let (frames, _) = shown(uis, 1);
    let steps: Vec<u8> = (0..10).collect();
    let found: Vec<u8> = frames
        .iter()
        .filter(|(frame, pixel)| frame.present_at > at(0) && pixel[1..] == [0, 0, 255])
        .map(|(_, pixel)| pixel[0])
        .collect();
    assert_eq!(found, steps, "one new picture per refresh");
}
