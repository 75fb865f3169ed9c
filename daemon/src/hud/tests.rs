//! The HUD shows what it should, where it should, and nothing when it is off.

use foreframe_engine::color::ColorFormat;
use foreframe_engine::format::{
    CameraMotion, MotionConvention, MotionDirection, MotionFormat, MotionUnit, StreamFormat,
};
use foreframe_engine::key::{KeyInput, PlaneInput};
use foreframe_engine::{Engine, EngineConfig, Method, MonoSpan, MonoTime, Phase};

use super::*;

const WIDTH: u32 = 512;
const HEIGHT: u32 = 256;

fn presented(kind: FrameKind, index: u64) -> PresentedFrame {
    let at = MonoTime::ZERO;
    PresentedFrame {
        index,
        key_index: 0,
        key_content_time: at,
        phase: Phase::ZERO,
        kind,
        content_time: at,
        present_at: at,
        presented_at: at,
        repeats_before: 0,
        work: MonoSpan::ZERO,
    }
}

fn hud(view: HudView) -> Hud {
    let mut hud = Hud::default();
    hud.set_view(view);
    let mut report = StreamStatus { width: WIDTH, height: HEIGHT, ..StreamStatus::default() };
    report.ready_before_refresh = [1, 2, 3, 4, 5, 6];
    report.latency_ms.whole.p50 = 12.5;
    hud.report(&report);
    hud
}

fn gray(format: ColorFormat) -> ColorPlane {
    ColorPlane::new(format, WIDTH, HEIGHT)
}

fn bytes(picture: &ColorPlane) -> Vec<u8> {
    let mut bytes = Vec::new();
    picture.write_bytes(&mut bytes);
    bytes
}

/// An engine whose one key moves right in its left half and down in its right half.
fn engine() -> Engine {
    let format = StreamFormat {
        motion: Some(MotionConvention {
            format: MotionFormat::Rg32f,
            direction: MotionDirection::PreviousToCurrent,
            unit: MotionUnit::Pixels,
            scale: [1.0; 2],
            camera_motion: CameraMotion::Included,
        }),
        ..StreamFormat::rgba8(WIDTH, HEIGHT)
    };
    let mut engine =
        Engine::new(format, EngineConfig::new(Method::Linear, std::num::NonZero::<usize>::MIN));
    let color = vec![90; (WIDTH * HEIGHT * 4) as usize];
    let motion: Vec<u8> = (0..WIDTH * HEIGHT)
        .flat_map(|i| if i % WIDTH < WIDTH / 2 { [6.0_f32, 0.0] } else { [0.0, 6.0] })
        .flat_map(f32::to_le_bytes)
        .collect();
    let plane =
        |bytes, bytes_per_pixel| PlaneInput::packed(bytes, [WIDTH, HEIGHT], bytes_per_pixel);
    let content_time = MonoTime::ZERO + MonoSpan::from_ms(100);
    engine
        .push_key(&KeyInput {
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
        .unwrap();
    engine
}

#[test]
fn names_lead_back_to_their_views_and_a_key_press_goes_through_all_of_them() {
    let mut view = HudView::Off;
    for _ in HudView::ALL {
        assert_eq!(view.name().parse(), Ok(view));
        view = view.next();
    }
    assert_eq!(view, HudView::Off);
    assert!("statistics".parse::<HudView>().unwrap_err().contains("stats, motion"));
}

#[test]
fn off_changes_no_byte_and_numbers_change_their_corner_alone_in_every_format() {
    for format in [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f] {
        let before = bytes(&gray(format));
        let drawn = |view| {
            let mut picture = gray(format);
            hud(view).draw(&presented(FrameKind::Real, 0), None, &mut picture);
            bytes(&picture)
        };
        assert_eq!(drawn(HudView::Off), before);
        let stats = drawn(HudView::Stats);
        let pixel_bytes = format.bytes_per_pixel() as usize;
        let changed: Vec<usize> = (0..before.len() / pixel_bytes)
            .filter(|i| {
                let range = i * pixel_bytes..(i + 1) * pixel_bytes;
                stats[range.clone()] != before[range]
            })
            .collect();
        assert!(changed.len() > 10_000, "{format:?}: {}", changed.len());
        for pixel in changed {
            let (x, y) = (pixel % WIDTH as usize, pixel / WIDTH as usize);
            assert!((12..408).contains(&x) && (12..194).contains(&y), "{format:?} {x}, {y}");
        }
    }
}

#[test]
fn a_panel_larger_than_the_picture_is_cut_off() {
    let mut picture = ColorPlane::new(ColorFormat::Rgba8, 40, 20);
    hud(HudView::Stats).draw(&presented(FrameKind::Real, 0), None, &mut picture);
    let mut tiny = ColorPlane::new(ColorFormat::Rgba8, 4, 4);
    hud(HudView::Tear).draw(&presented(FrameKind::Real, 0), None, &mut tiny);
}

#[test]
fn motion_shows_directions_apart_and_the_grid_moves_with_the_phase() {
    let engine = engine();
    let drawn = |view: HudView, halves: i64| {
        let mut picture = ColorPlane::new(ColorFormat::Rgba8, WIDTH, HEIGHT);
        let (key, interval) = (MonoTime::ZERO, MonoSpan::from_ms(25));
        let phase = Phase::at(key + interval.scale(halves, 2), key, interval);
        let frame = PresentedFrame { phase, ..presented(FrameKind::Real, 0) };
        let mut hud = Hud::default();
        hud.set_view(view);
        hud.draw(&frame, engine.inspect(), &mut picture);
        bytes(&picture)
    };
    let motion = drawn(HudView::Motion, 0);
    let at = |x: u32, y: u32| {
        let first = ((y * WIDTH + x) * 4) as usize;
        [motion[first], motion[first + 1], motion[first + 2]]
    };
    assert_eq!(at(40, 40), at(90, 200), "one direction, one colour");
    assert_ne!(at(40, 40), at(WIDTH - 40, 40));
    // 6 pixels a key on black: more than a quarter of the whole range.
    assert!(at(40, 40).into_iter().max() > Some(64), "{:?}", at(40, 40));
    assert_ne!(drawn(HudView::Grid, 0), drawn(HudView::Grid, 1));
    assert_eq!(drawn(HudView::Grid, 1), drawn(HudView::Grid, 1));
    let linear = drawn(HudView::Rungs, 0);
    assert!(linear.chunks(4).all(|pixel| pixel == &linear[..4]), "one method, one colour");
}

#[test]
fn what_comes_into_sight_is_marked_and_grows_with_the_phase() {
    let engine = engine();
    let marked = |phase: f64| {
        let uncovered = engine.inspect().unwrap().uncovered(phase, 4);
        let is_marked = |x: u32, y: u32| uncovered.at(x / 4, y / 4);
        // The left half moves right, the right half down: from either border inwards.
        assert!(!is_marked(WIDTH / 4, HEIGHT / 2) && !is_marked(WIDTH - 9, HEIGHT / 2));
        let left = (0..WIDTH / 2).filter(|x| is_marked(*x, HEIGHT / 2)).count();
        let top = (0..HEIGHT).filter(|y| is_marked(WIDTH - 9, *y)).count();
        (left, top)
    };
    assert_eq!(marked(0.0), (0, 0));
    assert_eq!(marked(2.0), (12, 12));
    assert_eq!(marked(4.0), (24, 24));
    let mut hud = Hud::default();
    hud.set_view(HudView::Disocclusion);
    let mut picture = gray(ColorFormat::Rgba8);
    hud.draw(&presented(FrameKind::Real, 0), engine.inspect(), &mut picture);
    assert_eq!(bytes(&picture), bytes(&gray(ColorFormat::Rgba8)), "at a key nothing is filled");
}

#[test]
fn shares_of_models_add_up() {
    let engine = engine();
    assert_eq!(engine.inspect().unwrap().rung_percent(), [("linear", 100.0)]);
}

#[test]
fn the_bar_of_tear_changes_with_every_frame() {
    let drawn = |index| {
        let mut picture = gray(ColorFormat::Rgba8);
        let mut hud = Hud::default();
        hud.set_view(HudView::Tear);
        hud.draw(&presented(FrameKind::Real, index), None, &mut picture);
        bytes(&picture)
    };
    assert_ne!(drawn(0), drawn(1));
    assert_eq!(drawn(0), drawn(2));
}

#[test]
fn real_and_synthesised_frames_can_be_seen_apart() {
    let shown =
        |view: HudView| [FrameKind::Real, FrameKind::Synthesised].map(|kind| view.shows(kind));
    assert_eq!(shown(HudView::OnlyReal), [true, false]);
    assert_eq!(shown(HudView::OnlySynthesised), [false, true]);
    assert_eq!(shown(HudView::Stats), [true, true]);
}
