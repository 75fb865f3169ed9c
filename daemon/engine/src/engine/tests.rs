//! The engine as its users see it: keys in, frames out.

use super::*;
use crate::finish::FinishMode;
use crate::format::{
    CameraMotion, DepthConvention, DepthFormat, DepthMeaning, MotionConvention, MotionDirection,
    MotionFormat, MotionUnit,
};
use crate::key::PlaneInput;

mod change_of_method;
mod light;
mod mask;

const SIZE: u32 = 16;

fn format() -> StreamFormat {
    StreamFormat {
        motion: Some(MotionConvention {
            format: MotionFormat::Rg32f,
            direction: MotionDirection::PreviousToCurrent,
            unit: MotionUnit::Pixels,
            scale: [1.0, 1.0],
            camera_motion: CameraMotion::Included,
        }),
        ..StreamFormat::rgba8(SIZE, SIZE)
    }
}

fn engine(method: Method) -> Engine {
    Engine::new(format(), EngineConfig::new(method, NonZeroUsize::MIN))
}

/// Pushes a key whose pixel (x, y) is `seed + 16 * y + x` in each channel, moving 3 pixels right
/// per 25 ms.
fn push(engine: &mut Engine, at_ms: i64, seed: u8) -> Result<KeyReport, DecodeError> {
    let color: Vec<u8> = (0..=255_u8).flat_map(|pixel| [pixel.wrapping_add(seed); 4]).collect();
    let motion: Vec<u8> =
        (0..256).flat_map(|_| [3.0_f32, 0.0]).flat_map(f32::to_le_bytes).collect();
    let plane = |bytes, bytes_per_pixel| PlaneInput::packed(bytes, [SIZE, SIZE], bytes_per_pixel);
    let content_time = MonoTime::ZERO + MonoSpan::from_ms(at_ms);
    engine.push_key(&KeyInput {
        index: 0,
        content_time,
        motion_from: Some(content_time - MonoSpan::from_ms(25)),
        is_cut: false,
        color: plane(&color, 4),
        depth: None,
        motion: Some(plane(&motion, 8)),
        mask: None,
        camera: None,
        motion_from_camera: None,
    })
}

fn frame(engine: &mut Engine, at_ms: i64) -> Vec<u8> {
    let mut out = ColorPlane::default();
    engine.synthesise(MonoTime::ZERO + MonoSpan::from_ms(at_ms), &mut out).unwrap();
    let mut bytes = Vec::new();
    out.write_bytes(&mut bytes);
    bytes.into_iter().step_by(4).collect()
}

#[test]
fn gather_moves_the_picture_by_its_motion_times_the_phase() {
    let mut engine = engine(Method::Gather);
    push(&mut engine, 100, 0).unwrap();
    let key = frame(&mut engine, 100);
    let later = frame(&mut engine, 125);
    for y in 0..16 {
        assert_eq!(later[y * 16 + 3..][..13], key[y * 16..][..13], "row {y}");
    }
}

#[test]
fn blend_is_the_mean_strictly_between_the_keys_and_a_key_elsewhere() {
    let mut engine = engine(Method::Blend);
    push(&mut engine, 100, 0).unwrap();
    let older = frame(&mut engine, 100);
    push(&mut engine, 125, 10).unwrap();
    let newer = frame(&mut engine, 125);
    assert_ne!(older, newer);
    assert_eq!(frame(&mut engine, 90), older);
    assert_eq!(frame(&mut engine, 100), older);
    assert_eq!(frame(&mut engine, 130), newer);
    for at_ms in [101, 124] {
        for ((mean, a), b) in frame(&mut engine, at_ms).into_iter().zip(&older).zip(&newer) {
            assert_eq!(u32::from(mean), (u32::from(*a) + u32::from(*b)).div_ceil(2));
        }
    }
}

#[test]
fn a_cut_lets_go_of_no_key_frame_and_what_follows_needs_no_other() {
    let mut engine = engine(Method::Linear);
    let (color, motion) = ([7; 4 * 256], [0; 8 * 256]);
    let depth: Vec<u8> = (0..256).flat_map(|_| 0.5_f32.to_le_bytes()).collect();
    let plane = |bytes, bytes_per_pixel| PlaneInput::packed(bytes, [SIZE, SIZE], bytes_per_pixel);
    engine.format.depth =
        Some(DepthConvention { format: DepthFormat::F32, meaning: DepthMeaning::LinearView });
    let mut held = Vec::new();
    for index in 0..24 {
        let content_time = MonoTime::ZERO + MonoSpan::from_ms(25 * (index as i64 + 1));
        let input = KeyInput {
            index,
            content_time,
            motion_from: Some(content_time - MonoSpan::from_ms(25)),
            is_cut: index % 8 == 0,
            color: plane(&color, 4),
            depth: Some(plane(&depth, 4)),
            motion: Some(plane(&motion, 8)),
            mask: None,
            camera: None,
            motion_from_camera: None,
        };
        engine.push_key(&input).unwrap();
        let keys = engine.newest.iter().chain(&engine.previous).chain(&engine.remembered);
        held.push(keys.chain(&engine.spares).count());
    }
    let most = held[7];
    assert!(most > MOST_KEYS, "the memory is full before the second cut");
    assert!(held[8..].iter().all(|count| *count == most), "{held:?}");
}

#[test]
fn content_time_that_does_not_advance_is_refused_and_the_keys_stay() {
    let mut engine = engine(Method::Hold);
    push(&mut engine, 100, 0).unwrap();
    let before = frame(&mut engine, 100);
    let refused = push(&mut engine, 100, 7).unwrap_err();
    assert!(matches!(refused, DecodeError::TimeBackwards { .. }), "{refused}");
    assert_eq!(frame(&mut engine, 100), before);
    push(&mut engine, 101, 7).unwrap();
    assert_ne!(frame(&mut engine, 100), before);
}

#[cfg(feature = "gpu")]
mod on_gpus {
    use super::*;
    use crate::backend::gpu::test_adapters::test_gpus;

    const MOVING: [Method; 5] =
        [Method::Blend, Method::Voxel, Method::Gather, Method::Grid, Method::Linear];

    /// What two engines show over three keys, two frames each, the second one after `event` was
    /// told of each step.
    fn shown(engine: &mut Engine, mut event: impl FnMut(usize)) -> Vec<Vec<u8>> {
        let mut frames = Vec::new();
        for (step, at_ms) in [100, 125, 150].into_iter().enumerate() {
            push(engine, at_ms, at_ms as u8).unwrap();
            for (half, after_ms) in [-10, 7].into_iter().enumerate() {
                event(2 * step + half);
                frames.push(frame(engine, at_ms + after_ms));
            }
        }
        frames
    }

    #[test]
    fn a_stream_on_a_gpu_shows_what_one_on_the_cpu_does() {
        for gpu in test_gpus("a_stream_on_a_gpu_shows_what_one_on_the_cpu_does") {
            for method in Method::ALL {
                let mut on_gpu = engine(method);
                on_gpu.use_gpu(&gpu);
                let frames = shown(&mut on_gpu, |_| ());
                assert_eq!(frames, shown(&mut engine(method), |_| ()), "{method}");
                let name = format!("gpu:{}", gpu.name());
                let expected = BackendStatus { name, fell_back: None };
                assert_eq!(on_gpu.backend(), &expected, "{method}");
            }
        }
    }

    #[test]
    fn a_stream_whose_gpu_is_lost_goes_on_with_the_same_pictures() {
        for step in 0..6 {
            for method in MOVING {
                for gpu in test_gpus("a_stream_whose_gpu_is_lost_goes_on_with_the_same_pictures") {
                    let mut on_gpu = engine(method);
                    on_gpu.use_gpu(&gpu);
                    let frames = shown(&mut on_gpu, |now| {
                        if now == step {
                            gpu.lose();
                        }
                    });
                    assert_eq!(
                        frames,
                        shown(&mut engine(method), |_| ()),
                        "{method}, lost at step {step} on {}",
                        gpu.name()
                    );
                    // A method may have nothing to do on the device after it was lost.
                    if step < 4 {
                        let status = on_gpu.backend();
                        assert_eq!(status.name, "cpu", "{method}, step {step}");
                        let why = status.fell_back.as_deref().unwrap();
                        assert!(why.contains("lost"), "{why}");
                        assert!(gpu.is_lost(), "{method}, step {step}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_stream_that_starts_on_a_lost_gpu_runs_on_the_cpu() {
        for gpu in test_gpus("a_stream_that_starts_on_a_lost_gpu_runs_on_the_cpu") {
            gpu.lose();
            let mut on_gpu = engine(Method::Linear);
            on_gpu.use_gpu(&gpu);
            let frames = shown(&mut on_gpu, |_| ());
            assert_eq!(frames, shown(&mut engine(Method::Linear), |_| ()));
            assert_eq!(on_gpu.backend().name, "cpu");
            assert!(on_gpu.backend().fell_back.is_some());
        }
    }
}

#[test]
fn finishing_is_off_by_default_and_on_it_shares_the_light_of_a_key_among_its_frames() {
    let with = |mode| {
        let finish = FinishConfig { mode, is_whole: true, ..FinishConfig::default() };
        let config = EngineConfig { finish, ..EngineConfig::new(Method::Hold, NonZeroUsize::MIN) };
        let mut engine = Engine::new(format(), config);
        let alternates = engine.alternates();
        let frames: Vec<_> = (0..3)
            .flat_map(|key| {
                push(&mut engine, 25 * (key + 1), 0).unwrap();
                [0, 8].map(|later| frame(&mut engine, 25 * (key + 1) + later))
            })
            .collect();
        (frames, alternates)
    };
    let ((off, off_alternates), (on, on_alternates)) =
        (with(FinishMode::Off), with(FinishMode::On));
    assert!(!off_alternates && on_alternates);
    assert!(off.iter().all(|frame| *frame == off[0]));
    assert_eq!(on[..2], off[..2], "nobody knows yet how many frames a key has");
    assert_ne!(on[2], on[3]);
    assert_eq!((&on[4], &on[5]), (&on[2], &on[3]), "key and in-between frame, in turn");
    for ((key, between), original) in on[2].iter().zip(&on[3]).zip(&off[2]) {
        let ends = [key.min(between), key.max(between)];
        assert!((ends[0]..=ends[1]).contains(&original), "{original} of {key} and {between}");
    }
}

/// Pushes a key of noise by `seed`, whose vectors claim `claimed` pixels right.
fn push_place(engine: &mut Engine, at_ms: i64, seed: u32, moved: u32, claimed: f32) {
    let (width, height) = (128, 64);
    let shown = |x: u32, y: u32| {
        let (x, y) = (x.wrapping_sub(moved), y);
        let fine = crate::testing::hash(x / 3, y / 3, seed) % 60;
        (fine + crate::testing::hash(x / 32, y / 32, seed) % 90) as u8
    };
    let color: Vec<u8> =
        (0..height).flat_map(|y| (0..width).flat_map(move |x| [shown(x, y); 4])).collect();
    let motion: Vec<u8> =
        (0..width * height).flat_map(|_| [claimed, 0.0]).flat_map(f32::to_le_bytes).collect();
    let plane =
        |bytes, bytes_per_pixel| PlaneInput::packed(bytes, [width, height], bytes_per_pixel);
    let content_time = MonoTime::ZERO + MonoSpan::from_ms(at_ms);
    let pushed = engine.push_key(&KeyInput {
        index: 0,
        content_time,
        motion_from: Some(content_time - MonoSpan::from_ms(25)),
        is_cut: false,
        color: plane(&color, 4),
        depth: None,
        motion: Some(plane(&motion, 8)),
        mask: None,
        camera: None,
        motion_from_camera: None,
    });
    pushed.unwrap();
}

#[test]
fn no_frame_moves_after_a_cut_that_nobody_declared_and_a_skipped_key_is_no_cut() {
    let format = StreamFormat { width: 128, height: 64, ..format() };
    let mut engine = Engine::new(format, EngineConfig::new(Method::Auto, NonZeroUsize::MIN));
    let mut moving = Vec::new();
    // Three keys of a place, one of them skipped, then another place.
    for (at_ms, seed, moved) in [(25, 1, 3), (50, 1, 6), (100, 1, 12), (125, 2, 15), (150, 2, 18)] {
        push_place(&mut engine, at_ms, seed, moved, 3.0);
        let key = frame(&mut engine, at_ms);
        let after: Vec<_> = [6, 12, 18].map(|ms| frame(&mut engine, at_ms + ms)).into();
        moving.push(after.iter().filter(|frame| **frame != key).count());
    }
    assert_eq!(moving[1..], [3, 3, 0, 3], "frames that move, by key");
}

#[test]
fn a_cut_between_two_places_in_which_nothing_moves_is_noticed() {
    let format = StreamFormat { width: 128, height: 64, ..format() };
    let mut engine = Engine::new(format, EngineConfig::new(Method::Auto, NonZeroUsize::MIN));
    let is_cut: Vec<bool> = [(25, 1), (50, 1), (75, 1), (100, 2), (125, 2)]
        .into_iter()
        .map(|(at_ms, seed)| {
            push_place(&mut engine, at_ms, seed, 0, 0.0);
            let (_, _, evidence) = engine.newest_seen().unwrap();
            let is_cut = evidence.unwrap().is_cut();
            assert_eq!(engine.newest.as_ref().unwrap().is_found_cut, is_cut, "nothing crosses it");
            is_cut
        })
        .collect();
    assert_eq!(is_cut, [false, false, false, true, false]);
}

#[test]
fn a_picture_that_comes_to_rest_is_not_blurred() {
    let format = StreamFormat { width: 128, height: 64, ..format() };
    let shown = |mode| {
        let finish = FinishConfig { mode, ..FinishConfig::default() };
        let config = EngineConfig { finish, ..EngineConfig::new(Method::Auto, NonZeroUsize::MIN) };
        let mut engine = Engine::new(format, config);
        let mut pictures = Vec::new();
        for key in 1..=8 {
            let moved = key.min(4);
            let claimed = if key <= 4 { 3.0 } else { 0.0 };
            push_place(&mut engine, 25 * i64::from(key), 1, 3 * moved, claimed);
            pictures.push([0, 8, 16].map(|ms| frame(&mut engine, 25 * i64::from(key) + ms)));
        }
        pictures
    };
    let (off, on) = (shown(FinishMode::Off), shown(FinishMode::On));
    // What was paid for while it moved has been shown by then.
    assert_eq!(off[5..], on[5..]);
}
