//! The protocol on recordings of which everything is known.

mod retina;

use super::*;
use crate::recording::memory::MemoryRecording;
use crate::score::flips::RUNGS;
use crate::score::metrics::{psnr_rgb_db, psnr_y_db};
use crate::score::report::MethodScore;

const STEP: [i64; 2] = [3, 1];

fn options(methods: &[Method]) -> ScoreOptions {
    let count = |n| NonZeroUsize::new(n).unwrap();
    ScoreOptions {
        methods: methods.to_vec(),
        ratio: count(4),
        backends: vec![None],
        threads: count(1),
        timer: || MonoTime::ZERO,
        retina: false,
        finish: FinishConfig::default(),
        kept_frames: 0,
        late_camera: false,
    }
}

fn score(recording: &mut MemoryRecording, methods: &[Method]) -> CaptureScore {
    score_recording("patch", recording, &options(methods), || {}).unwrap()
}

fn of(capture: &CaptureScore, method: Method) -> &MethodScore {
    capture.methods.iter().find(|score| score.name == method.name()).unwrap()
}

fn picture(recording: &MemoryRecording, frame: usize) -> Srgb8 {
    let (pixels, _) = recording.frames[frame].color.bytes.as_chunks::<4>();
    let rgb = pixels.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    Plane::from_vec(recording.format().width, recording.format().height, rgb)
}

fn assert_near(found: Option<f64>, expected: f64) {
    let found = found.expect("there are frames");
    assert!((found - expected).abs() < 1e-9, "expected {expected}, found {found}");
}

#[test]
fn hold_is_scored_as_the_key_itself_against_each_truth() {
    let mut recording = MemoryRecording::moving_patch(10, STEP, &[4]);
    let capture = score(&mut recording, &[Method::Hold]);
    assert_eq!((capture.keys, capture.ratio, capture.left_out), (3, 4, 0));
    let hold = of(&capture, Method::Hold);
    assert_eq!(hold.frames, 6, "frame 9 lies after the last key");
    let pairs = [(0, 1), (0, 2), (0, 3), (4, 5), (4, 6), (4, 7)];
    let pictures = pairs.map(|(key, truth)| (picture(&recording, key), picture(&recording, truth)));
    let mean = |metric: fn(&Srgb8, &Srgb8) -> f64| {
        pictures.iter().map(|(key, truth)| metric(key, truth)).sum::<f64>() / 6.0
    };
    assert_near(hold.psnr_rgb_db, mean(psnr_rgb_db));
    assert_near(hold.psnr_y_db, mean(psnr_y_db));
    assert_eq!(hold.psnr_y_by_phase_db.len(), 3);
    for (place, found) in hold.psnr_y_by_phase_db.iter().enumerate() {
        let at = |i: usize| psnr_y_db(&pictures[i].0, &pictures[i].1);
        assert_near(*found, f64::midpoint(at(place), at(place + 3)));
    }
}

#[test]
fn motion_composed_along_the_frames_scores_as_motion_of_the_key_step() {
    let methods = [Method::Gather, Method::Grid, Method::Linear];
    let own = score(&mut MemoryRecording::moving_patch(9, STEP, &[1, 4]), &methods);
    let mut composed_alone = MemoryRecording::moving_patch(9, STEP, &[1]);
    // The first key has no frames before it: only its own field of one step would differ.
    composed_alone.heads[0].motions[0] = own_first_span();
    composed_alone.frames[0].motions =
        MemoryRecording::moving_patch(1, STEP, &[4]).frames[0].motions.clone();
    let composed = score(&mut composed_alone, &methods);
    assert_eq!((own.key_motion.own, own.key_motion.composed), (3, 0));
    assert_eq!((composed.key_motion.own, composed.key_motion.composed), (1, 2));
    for method in methods {
        assert_eq!(of(&own, method), of(&composed, method), "{method}");
    }
}

fn own_first_span() -> MonoTime {
    crate::recording::memory::time(-4)
}

#[test]
fn nothing_later_than_the_newest_key_reaches_a_method_that_extrapolates() {
    let clean = MemoryRecording::moving_patch(9, STEP, &[4]);
    let mut poisoned = clean.clone();
    poisoned.poison(8);
    let before = score(&mut clean.clone(), &Method::ALL);
    let after = score(&mut poisoned, &Method::ALL);
    for method in Method::ALL {
        let is_same = of(&before, method) == of(&after, method);
        assert_eq!(is_same, !method.interpolates(), "{method}");
    }
}

#[test]
fn depth_and_motion_of_a_truth_are_not_even_read() {
    let mut recording = MemoryRecording::moving_patch(9, STEP, &[4]);
    score(&mut recording, &Method::ALL);
    for (frame, wanted) in &recording.reads {
        let is_key = frame % 4 == 0;
        assert_eq!(*wanted != Wanted::Color, is_key, "frame {frame}: {wanted:?}");
    }
}

#[test]
fn frames_from_a_cut_to_the_next_key_are_left_out_for_all_methods() {
    let mut recording = MemoryRecording::moving_patch(13, STEP, &[4]);
    recording.heads[6].is_cut = true;
    let capture = score(&mut recording, &Method::ALL);
    assert_eq!(capture.left_out, 2);
    assert_eq!(capture.key_motion.missing, 1, "the cut key's own motion is not used");
    for score in &capture.methods {
        assert_eq!(score.frames, 7, "{}", score.name);
    }
    let held_after_keys = held(0, 1) + held(4, 5) + held(8, 9);
    assert_near(of(&capture, Method::Hold).psnr_y_by_phase_db[0], held_after_keys / 3.0);
    let without_cut = score(&mut MemoryRecording::moving_patch(13, STEP, &[4]), &[Method::Gather]);
    let after_cut = |capture| of(capture, Method::Gather).psnr_y_by_phase_db[0];
    assert!(after_cut(&capture) < after_cut(&without_cut), "after the cut nothing moves");
}

/// What holding a key gives for a later frame.
fn held(key: usize, truth: usize) -> f64 {
    let recording = MemoryRecording::moving_patch(13, STEP, &[4]);
    psnr_y_db(&picture(&recording, truth), &picture(&recording, key))
}

#[test]
fn no_method_sees_what_comes_after_a_cut_before_it_comes() {
    let mut recording = MemoryRecording::moving_patch(9, STEP, &[4]);
    recording.heads[8].is_cut = true;
    let clean = score(&mut recording.clone(), &Method::ALL);
    recording.poison(8);
    let poisoned = score(&mut recording, &Method::ALL);
    assert_eq!(clean, poisoned);
}

#[test]
fn keys_without_depth_or_motion_go_by_their_pictures() {
    let mut recording = MemoryRecording::moving_patch(9, STEP, &[]);
    for frame in &mut recording.frames {
        frame.depth = None;
    }
    let capture = score(&mut recording, &Method::ALL);
    assert_eq!(capture.key_motion.missing, 3);
    let hold = of(&capture, Method::Hold).psnr_rgb_db;
    for method in [Method::Gather, Method::Grid, Method::Linear] {
        assert!(of(&capture, method).psnr_rgb_db > hold, "{method}");
    }
    let [flow, linear] = [Method::Flow, Method::Linear].map(|method| of(&capture, method));
    assert_eq!(flow.psnr_rgb_db, linear.psnr_rgb_db, "both have nothing else");
}

#[test]
fn blend_is_the_mean_of_the_two_keys_around_the_frame() {
    let mut recording = MemoryRecording::moving_patch(5, STEP, &[4]);
    let blend = &score(&mut recording, &[Method::Blend]).methods[0];
    let (first, last) = (picture(&recording, 0), picture(&recording, 4));
    let mean = |(a, b): (&[u8; 3], &[u8; 3])| {
        [0, 1, 2].map(|c| u16::from(a[c]).midpoint(u16::from(b[c]) + 1) as u8)
    };
    let pixels = first.data().iter().zip(last.data()).map(mean).collect();
    let expected = Plane::from_vec(first.width(), first.height(), pixels);
    let psnr = [1, 2, 3].map(|frame| psnr_rgb_db(&expected, &picture(&recording, frame)));
    assert_near(blend.psnr_rgb_db, psnr.iter().sum::<f64>() / 3.0);
}

#[test]
fn an_empty_recording_is_an_error_that_says_so() {
    let mut recording = MemoryRecording::moving_patch(0, STEP, &[4]);
    let error = score_recording("none", &mut recording, &options(&[Method::Hold]), || {});
    assert!(error.unwrap_err().to_string().contains("no frames"));
}

#[test]
fn a_recording_of_one_frame_has_keys_but_no_values() {
    let capture = score(&mut MemoryRecording::moving_patch(1, STEP, &[4]), &[Method::Hold]);
    assert_eq!((capture.keys, capture.methods[0].frames), (1, 0));
    assert_eq!(capture.methods[0].psnr_rgb_db, None);
}
#[test]
fn exact_motion_of_whole_pixels_is_predicted_to_the_bit() {
    let mut recording = MemoryRecording::moving_patch(9, STEP, &[4]);
    let linear = &score(&mut recording, &[Method::Linear]).methods[0];
    assert_near(linear.psnr_rgb_db, 100.0);
    assert_near(linear.error_flicker, 0.0);
    assert_near(linear.worst_tile_psnr_db, 50.0);
    assert_near(linear.flip, 0.0);
}

#[test]
fn frames_to_keep_are_spread_over_all_that_are_predicted_and_no_more_than_there_are() {
    let recording = MemoryRecording::moving_patch(13, STEP, &[4]);
    let plan = Plan::new(recording.heads(), NonZeroUsize::new(4).unwrap());
    assert!(kept_frames(&plan, 0).is_empty());
    assert_eq!(kept_frames(&plan, 3), [2, 6, 10]);
    assert_eq!(kept_frames(&plan, 50), [1, 2, 3, 5, 6, 7, 9, 10, 11]);
}

#[test]
fn a_kept_frame_has_the_truth_and_what_each_method_made_of_it() {
    let mut recording = MemoryRecording::moving_patch(9, STEP, &[4]);
    let methods = [Method::Hold, Method::Linear];
    let options = ScoreOptions { kept_frames: 2, ..options(&methods) };
    let capture = score_recording("patch", &mut recording, &options, || {}).unwrap();
    let frames: Vec<_> = capture.flips.iter().map(|flip| flip.frame).collect();
    assert_eq!(frames, [2, 6]);
    for flip in &capture.flips {
        assert_eq!(flip.truth, picture(&recording, flip.frame));
        assert_eq!(flip.shown.len(), 2);
        assert_eq!(flip.shown[1], flip.truth, "linear is exact here");
        assert_ne!(flip.shown[0], flip.truth);
        let names = flip.rungs.iter().map(|map| {
            assert_eq!([map.width(), map.height()], [flip.truth.width(), flip.truth.height()]);
            RUNGS[usize::from(map.at(30, 24))].name()
        });
        assert!(names.eq(["hold", "linear"]));
    }
    let by_frame = &capture.methods[0].by_frame;
    assert_eq!(by_frame.iter().map(|point| point.frame).collect::<Vec<_>>(), [1, 2, 3, 5, 6, 7]);
}
