//! One scene, told in every convention, must decode to the same field.

use std::sync::atomic::{AtomicU32, Ordering};

use super::*;
use crate::color::{ColorFormat, OrderedRgba16, half_to_ordered};
use crate::format::{
    DepthConvention, DepthFormat, MotionConvention, MotionDirection, MotionFormat, MotionUnit,
    ValidRectUse,
};
use crate::key::{Camera, Pixels, PlaneInput, ReadPixels, Velocity};
use crate::testing::pool;
use crate::time::{MonoSpan, MonoTime};

const WIDTH: u32 = 16;
const HEIGHT: u32 = 8;
const NEAR: f64 = 0.5;
const FAR: f64 = 64.0;

/// Distance of a cell: three surfaces, decisively apart, so that dilation has edges to work on.
fn distance(x: u32, y: u32) -> f64 {
    match (x / 5 + y / 3) % 3 {
        0 => 1.0,
        1 => 4.0,
        _ => 20.0,
    }
}

/// Newer minus older position in pixels, exact in a half float in every unit.
fn moved(x: u32, y: u32) -> [f32; 2] {
    [(x / 5) as f32 * 2.0 - 3.0, 1.5 - (y / 3) as f32]
}

struct Told {
    format: StreamFormat,
    depth: Vec<u8>,
    motion: Vec<u8>,
    camera: Option<Camera>,
}

fn depth_bytes(format: DepthFormat, value: f64) -> Vec<u8> {
    match format {
        DepthFormat::F32 => (value as f32).to_le_bytes().to_vec(),
        DepthFormat::F16 => half::f16::from_f64(value).to_le_bytes().to_vec(),
        DepthFormat::U16 => ((value * 65535.0).round() as u16).to_le_bytes().to_vec(),
        // The top byte belongs to somebody else (stencil).
        DepthFormat::U24 => {
            ((value * 16_777_215.0).round() as u32 | 0xa500_0000).to_le_bytes().to_vec()
        }
    }
}

fn motion_bytes(format: MotionFormat, [x, y]: [f32; 2]) -> Vec<u8> {
    match format {
        MotionFormat::Rg32f => [x, y].map(f32::to_le_bytes).concat(),
        MotionFormat::Rg16f => {
            [x, y].map(|value| half::f16::from_f32(value).to_le_bytes()).concat()
        }
    }
}

/// A perspective projection whose depth buffer is as told.
fn projection(meaning: DepthMeaning, far: f64) -> [f32; 16] {
    let ratio = if far.is_finite() { NEAR / far } else { 0.0 };
    // d = a + b / w with d(near) and d(far) 0 and 1, or 1 and 0.
    let (a, b) = match meaning {
        DepthMeaning::Reversed => (-ratio / (1.0 - ratio), NEAR / (1.0 - ratio)),
        _ => (1.0 / (1.0 - ratio), -NEAR / (1.0 - ratio)),
    };
    let mut matrix = [0.0; 16];
    matrix[0] = 1.25;
    matrix[5] = 2.5;
    matrix[10] = -a as f32;
    matrix[11] = -1.0;
    matrix[14] = b as f32;
    matrix
}

fn camera(projection: [f32; 16]) -> Camera {
    let mut view = [0.0; 16];
    for i in [0, 5, 10, 15] {
        view[i] = 1.0;
    }
    Camera { view, projection }
}

fn buffer_value(meaning: DepthMeaning, far: f64, distance: f64) -> f64 {
    let inverse = NEAR / distance;
    let ratio = NEAR / far;
    match meaning {
        DepthMeaning::LinearView => distance,
        DepthMeaning::Standard => (1.0 - inverse) / (1.0 - ratio),
        DepthMeaning::Reversed => (inverse - ratio) / (1.0 - ratio),
    }
}

fn tell(depth: DepthConvention, far: f64, with_camera: bool, motion: MotionConvention) -> Told {
    let mut told = Told {
        format: StreamFormat {
            depth: Some(depth),
            motion: Some(motion),
            ..StreamFormat::rgba8(WIDTH, HEIGHT)
        },
        depth: Vec::new(),
        motion: Vec::new(),
        camera: with_camera.then(|| camera(projection(depth.meaning, far))),
    };
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let value = buffer_value(depth.meaning, far, distance(x, y));
            told.depth.extend(depth_bytes(depth.format, value));
            let [dx, dy] = moved(x, y);
            let unit = match motion.unit {
                MotionUnit::Pixels => [1.0, 1.0],
                MotionUnit::Uv => [WIDTH as f32, HEIGHT as f32],
                MotionUnit::Ndc => [WIDTH as f32 / 2.0, -(HEIGHT as f32) / 2.0],
            };
            let sign =
                if motion.direction == MotionDirection::CurrentToPrevious { -1.0 } else { 1.0 };
            let stored =
                [sign * dx / unit[0] / motion.scale[0], sign * dy / unit[1] / motion.scale[1]];
            told.motion.extend(motion_bytes(motion.format, stored));
        }
    }
    told
}

fn plane(bytes: &[u8], width: u32, height: u32) -> PlaneInput<'_> {
    PlaneInput {
        pixels: Pixels::Bytes(bytes),
        width,
        height,
        stride: bytes.len() as u32 / height,
        valid: Rect::full(width, height),
        jitter: [0.0; 2],
    }
}

const COLOR: [u8; (WIDTH * HEIGHT * 4) as usize] = [7; (WIDTH * HEIGHT * 4) as usize];

fn at_ms(ms: i64) -> MonoTime {
    MonoTime::ZERO + MonoSpan::from_ms(ms)
}

fn input<'a>(told: &'a Told) -> KeyInput<'a> {
    KeyInput {
        index: 1,
        content_time: at_ms(100),
        motion_from: Some(at_ms(75)),
        is_cut: false,
        color: plane(&COLOR, WIDTH, HEIGHT),
        depth: Some(plane(&told.depth, WIDTH, HEIGHT)),
        motion: Some(plane(&told.motion, WIDTH, HEIGHT)),
        mask: None,
        camera: told.camera,
        motion_from_camera: None,
    }
}

fn decode(
    format: &StreamFormat,
    input: &KeyInput<'_>,
) -> Result<(KeyFrame, DecodeReport), DecodeError> {
    let mut key = KeyFrame::default();
    let mut scratch = DecodeScratch::default();
    let report = decode_key(&pool(1), format, input, None, &mut scratch, &mut key)?;
    Ok((key, report))
}

const MOTION: MotionConvention = MotionConvention {
    format: MotionFormat::Rg32f,
    direction: MotionDirection::PreviousToCurrent,
    unit: MotionUnit::Pixels,
    scale: [1.0, 1.0],
    camera_motion: CameraMotion::Included,
};
const DEPTH: DepthConvention =
    DepthConvention { format: DepthFormat::F32, meaning: DepthMeaning::LinearView };

fn truth() -> KeyFrame {
    let told = tell(DEPTH, FAR, false, MOTION);
    decode(&told.format, &input(&told)).unwrap().0
}

/// Order of all pairs of depth keys, which is what a convention must not change.
fn order(keys: &Plane<u32>) -> Vec<std::cmp::Ordering> {
    // Formats of few bits round: keys that differ by less than 1/64 are one surface.
    let surface = |key: u32| (f64::from(key.max(1)).log2() * 2.0).round() as i64;
    let keys = keys.data();
    keys.iter().flat_map(|a| keys.iter().map(|b| surface(*a).cmp(&surface(*b)))).collect()
}

#[test]
fn dilation_of_the_truth_spreads_the_nearest_motion_by_one_cell() {
    let truth = truth();
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let columns = x.saturating_sub(1)..=(x + 1).min(WIDTH - 1);
            let rows = y.saturating_sub(1)..=(y + 1).min(HEIGHT - 1);
            let cells = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
            let nearest = cells.map(|(x, y)| distance(x, y)).fold(f64::MAX, f64::min);
            let columns = x.saturating_sub(1)..=(x + 1).min(WIDTH - 1);
            let rows = y.saturating_sub(1)..=(y + 1).min(HEIGHT - 1);
            let source = if nearest < distance(x, y) {
                rows.flat_map(|y| columns.clone().map(move |x| (x, y)))
                    .find(|(x, y)| distance(*x, *y) <= nearest)
                    .unwrap()
            } else {
                (x, y)
            };
            let [dx, dy] = moved(source.0, source.1).map(|v| (v * 32.0) as i16);
            assert_eq!(truth.velocity.at(x, y), Velocity { x: dx, y: dy }, "at {x}, {y}");
        }
    }
}

#[test]
fn every_motion_convention_alone_and_combined_gives_the_same_field() {
    let truth = truth();
    for format in [MotionFormat::Rg16f, MotionFormat::Rg32f] {
        for direction in [MotionDirection::CurrentToPrevious, MotionDirection::PreviousToCurrent] {
            for unit in [MotionUnit::Pixels, MotionUnit::Uv, MotionUnit::Ndc] {
                for scale in [[1.0, 1.0], [-1.0, 1.0], [0.5, -0.25], [4.0, 2.0]] {
                    let motion = MotionConvention { format, direction, unit, scale, ..MOTION };
                    let told = tell(DEPTH, FAR, false, motion);
                    let key = decode(&told.format, &input(&told)).unwrap().0;
                    assert_eq!(key.velocity, truth.velocity, "{motion:?}");
                }
            }
        }
    }
}

#[test]
fn every_depth_convention_gives_the_same_order_and_the_same_field() {
    let truth = truth();
    let meanings = [DepthMeaning::Standard, DepthMeaning::Reversed, DepthMeaning::LinearView];
    let formats = [DepthFormat::F32, DepthFormat::F16, DepthFormat::U16, DepthFormat::U24];
    for meaning in meanings {
        for format in formats {
            let is_integer = matches!(format, DepthFormat::U16 | DepthFormat::U24);
            if is_integer && meaning == DepthMeaning::LinearView {
                continue; // normalised to 0..1: no distances
            }
            for far in [FAR, f64::INFINITY] {
                for with_camera in [false, true] {
                    let depth = DepthConvention { format, meaning };
                    let told = tell(depth, far, with_camera, MOTION);
                    let (key, report) = decode(&told.format, &input(&told)).unwrap();
                    let case = format!("{depth:?}, far {far}, camera {with_camera}");
                    assert_eq!(order(&key.depth), order(&truth.depth), "{case}");
                    assert_eq!(key.velocity, truth.velocity, "{case}");
                    assert_eq!(report, DecodeReport::default(), "{case}");
                }
            }
        }
    }
}

#[test]
fn keys_are_proportional_to_inverse_distance_when_the_projection_is_known() {
    for (meaning, far) in [
        (DepthMeaning::Standard, FAR),
        (DepthMeaning::Reversed, FAR),
        (DepthMeaning::Reversed, f64::INFINITY),
    ] {
        let told = tell(DepthConvention { meaning, ..DEPTH }, far, true, MOTION);
        let key = decode(&told.format, &input(&told)).unwrap().0;
        for (x, y) in [(0, 0), (6, 0), (11, 0)] {
            let expected = NEAR / distance(x, y) * f64::from(u32::MAX);
            let found = f64::from(key.depth.at(x, y));
            assert!((found / expected - 1.0).abs() < 1e-4, "{meaning:?}: {found} {expected}");
        }
    }
}

#[test]
fn the_projection_wins_over_the_declared_meaning_and_the_report_says_so() {
    let mut told =
        tell(DepthConvention { meaning: DepthMeaning::Reversed, ..DEPTH }, FAR, true, MOTION);
    let honest = decode(&told.format, &input(&told)).unwrap().0;
    told.format.depth = Some(DepthConvention { meaning: DepthMeaning::Standard, ..DEPTH });
    let (key, report) = decode(&told.format, &input(&told)).unwrap();
    assert_eq!(report.depth_contradiction, Some(DepthMeaning::Reversed));
    assert_eq!(key.depth, honest.depth);
    assert_eq!(key.velocity, honest.velocity);
}

#[test]
fn depth_that_is_no_number_counts_as_far_and_motion_that_is_none_as_untrackable() {
    let mut told = tell(DEPTH, FAR, false, MOTION);
    told.depth.clear();
    told.motion.clear();
    let motions = [f32::NAN, f32::INFINITY, 1024.0, -1e30, 1023.0];
    for i in 0..(WIDTH * HEIGHT) as usize {
        told.depth.extend(f32::to_le_bytes(if i == 0 { f32::NAN } else { f32::INFINITY }));
        told.motion.extend([motions[i % 5], 0.0].map(f32::to_le_bytes).concat());
    }
    let key = decode(&told.format, &input(&told)).unwrap().0;
    assert!(key.depth.data().iter().all(|depth| *depth == 0));
    for (i, velocity) in key.velocity.data().iter().enumerate() {
        assert_eq!(velocity.is_trackable(), i % 5 == 4, "cell {i}: {velocity:?}");
    }
    assert_eq!(key.velocity.data()[4].x, 1023 * 32);
}

#[test]
fn camera_motion_that_vectors_lack_is_added_from_depth_and_both_cameras() {
    // The camera moves right by 0.5 units: a still point at distance z moves left by
    // 0.5 * P[0][0] / z of half the width. Objects move by `moved` on top.
    for (meaning, far) in [
        (DepthMeaning::LinearView, FAR),
        (DepthMeaning::Standard, FAR),
        (DepthMeaning::Reversed, f64::INFINITY),
    ] {
        let lacking = MotionConvention { camera_motion: CameraMotion::Missing, ..MOTION };
        let told = tell(DepthConvention { meaning, ..DEPTH }, far, true, lacking);
        let older = told.camera.unwrap();
        let mut newer = older;
        newer.view[12] = -0.5;
        let input =
            KeyInput { camera: Some(newer), motion_from_camera: Some(older), ..input(&told) };
        let key = decode(&told.format, &input).unwrap().0;
        for (x, y) in [(0, 0), (6, 0), (12, 1), (1, 7)] {
            // Cells inside their surface: dilation leaves them alone.
            let camera_px = -0.5 * 1.25 / distance(x, y) * f64::from(WIDTH) / 2.0;
            let expected = f64::from(moved(x, y)[0]) + camera_px;
            let found = f64::from(key.velocity.at(x, y).x) / 32.0;
            assert!((found - expected).abs() <= 1.0 / 32.0, "{meaning:?}: {found} {expected}");
        }
        // Without the older camera there is no motion, and the report says why.
        let input = KeyInput { motion_from_camera: None, ..input };
        let (key, report) = decode(&told.format, &input).unwrap();
        assert!(report.lacks_camera_motion && key.motion_from.is_none());
        assert!(key.velocity.data().is_empty());
    }
}

#[test]
fn only_depth_or_only_motion_is_enough_for_what_it_tells() {
    let told = tell(DEPTH, FAR, false, MOTION);
    let motion_only = KeyInput { depth: None, ..input(&told) };
    let key = decode(&told.format, &motion_only).unwrap().0;
    assert!(key.depth.data().is_empty());
    for (x, y) in [(0, 0), (5, 3), (15, 7)] {
        let [dx, dy] = moved(x, y).map(|v| (v * 32.0) as i16);
        assert_eq!(key.velocity.at(x, y), Velocity { x: dx, y: dy });
    }
    let depth_only = KeyInput { motion: None, ..input(&told) };
    let key = decode(&told.format, &depth_only).unwrap().0;
    assert_eq!(key.depth, truth().depth);
    assert_eq!((key.motion_span(), key.velocity.data().len()), (None, 0));
}

#[test]
fn a_cut_keeps_its_depth_and_loses_its_motion() {
    let told = tell(DEPTH, FAR, false, MOTION);
    let cut = KeyInput { is_cut: true, ..input(&told) };
    let key = decode(&told.format, &cut).unwrap().0;
    assert!(key.is_cut && key.motion_from.is_none() && key.velocity.data().is_empty());
    assert_eq!(key.depth, truth().depth);
}

#[test]
fn a_coarser_plane_is_read_at_its_nearest_sample() {
    for (width, height) in [(16, 8), (8, 4), (11, 5), (9, 5), (4, 2)] {
        let told = tell(DEPTH, FAR, false, MOTION);
        let constant = [2.5_f32, -1.0].map(f32::to_le_bytes).concat();
        let motion = constant.repeat((width * height) as usize);
        let input = KeyInput { motion: Some(plane(&motion, width, height)), ..input(&told) };
        let key = decode(&told.format, &input).unwrap().0;
        assert_eq!((key.velocity.width(), key.velocity.height()), (WIDTH, HEIGHT));
        assert!(key.velocity.data().iter().all(|v| *v == Velocity { x: 80, y: -32 }));
        assert_eq!(key.depth, truth().depth, "{width}x{height}");
    }
}

#[test]
fn strides_and_valid_rectangles_do_not_change_what_is_read() {
    let told = tell(DEPTH, FAR, false, MOTION);
    // Each plane inside a larger one, surrounded by poison.
    let surround = |bytes: &[u8], bytes_per_pixel: usize| {
        let row = WIDTH as usize * bytes_per_pixel;
        let stride = row + 5 * bytes_per_pixel + 3;
        let mut larger = vec![0xff; stride * (HEIGHT as usize + 3)];
        for (y, pixels) in bytes.chunks(row).enumerate() {
            larger[(y + 2) * stride + 4 * bytes_per_pixel..][..row].copy_from_slice(pixels);
        }
        (larger, stride as u32)
    };
    let ((depth, depth_stride), (motion, motion_stride)) =
        (surround(&told.depth, 4), surround(&told.motion, 8));
    let inside = |bytes, stride| PlaneInput {
        pixels: Pixels::Bytes(bytes),
        width: WIDTH + 5,
        height: HEIGHT + 3,
        stride,
        valid: Rect { x: 4, y: 2, width: WIDTH, height: HEIGHT },
        jitter: [0.0; 2],
    };
    let input = KeyInput {
        depth: Some(inside(&depth, depth_stride)),
        motion: Some(inside(&motion, motion_stride)),
        ..input(&told)
    };
    let key = decode(&told.format, &input).unwrap().0;
    assert_eq!((key.depth, key.velocity), (truth().depth, truth().velocity));
}

#[test]
fn a_letterboxed_key_moves_its_rectangle_and_a_stretched_one_the_whole() {
    let told = tell(DEPTH, FAR, false, MOTION);
    let mut color = Vec::new();
    for y in 0..HEIGHT {
        color.extend((0..WIDTH).flat_map(|x| [if x < 8 && y < 4 { 200 } else { 9 }; 4]));
    }
    let valid = Rect { x: 0, y: 0, width: 8, height: 4 };
    let part = |bytes| PlaneInput { valid, ..plane(bytes, WIDTH, HEIGHT) };
    let input = KeyInput {
        color: part(&color),
        depth: Some(part(&told.depth)),
        motion: Some(part(&told.motion)),
        ..input(&told)
    };
    let boxed = decode(&told.format, &input).unwrap().0;
    assert_eq!(boxed.valid, valid);
    assert_eq!(boxed.velocity.at(0, 0), Velocity { x: -96, y: 48 });
    let stretching = StreamFormat { valid_rect_use: ValidRectUse::Stretch, ..told.format };
    let stretched = decode(&stretching, &input).unwrap().0;
    assert_eq!(stretched.valid, Rect::full(WIDTH, HEIGHT));
    assert_eq!(stretched.velocity.at(0, 0), Velocity { x: -192, y: 96 }, "pixels grow too");
    let mut bytes = Vec::new();
    stretched.color.write_bytes(&mut bytes);
    assert!(bytes.iter().all(|byte| *byte == 200), "nothing outside the rectangle is read");
}

#[test]
fn jitter_moves_the_field_against_the_colour() {
    let told = tell(DEPTH, FAR, false, MOTION);
    let plain = input(&told);
    let jittered = |plane: PlaneInput<'static>| PlaneInput { jitter: [0.25, -0.5], ..plane };
    let depth = Box::leak(told.depth.clone().into_boxed_slice());
    let motion = Box::leak(told.motion.clone().into_boxed_slice());
    let both = KeyInput {
        depth: Some(jittered(plane(depth, WIDTH, HEIGHT))),
        motion: Some(jittered(plane(motion, WIDTH, HEIGHT))),
        ..plain
    };
    let key = decode(&told.format, &both).unwrap().0;
    assert_eq!(key.field_offset, [64, -128]);
    assert_eq!(key.velocity, truth().velocity);
    // Colour rendered with the same jitter: they lie on each other again.
    let all = KeyInput { color: jittered(plane(&COLOR, WIDTH, HEIGHT)), ..both };
    assert_eq!(decode(&told.format, &all).unwrap().0.field_offset, [0, 0]);
}

#[test]
fn half_colour_is_clamped_to_finite_numbers_and_otherwise_kept() {
    let halves = [0x3c00_u16, 0x7e00, 0x7c00, 0xfc00, 0x8001, 0xfe01, 0x7bff, 0x0000];
    let format = StreamFormat { color: ColorFormat::Rgba16f, ..StreamFormat::rgba8(2, 1) };
    let bytes: Vec<u8> = halves.into_iter().flat_map(u16::to_le_bytes).collect();
    let told = tell(DEPTH, FAR, false, MOTION);
    let input = KeyInput { color: plane(&bytes, 2, 1), depth: None, motion: None, ..input(&told) };
    let key = decode(&format, &input).unwrap().0;
    let expected = [[0x3c00, 0, 0x7bff, 0xfbff], [0x8001, 0, 0x7bff, 0]]
        .map(|pixel| OrderedRgba16(pixel.map(half_to_ordered)));
    assert_eq!(key.color, ColorPlane::Rgba16f(Plane::from_vec(2, 1, expected.to_vec())));
}

#[test]
fn every_colour_format_comes_back_byte_for_byte() {
    for color in [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f] {
        let format = StreamFormat { color, ..StreamFormat::rgba8(3, 2) };
        let row = 3 * color.bytes_per_pixel() as usize;
        let pixels: Vec<u8> = (0..2 * row as u32).map(|i| (i * 37 % 120) as u8).collect();
        let padded: Vec<u8> =
            pixels.chunks(row).flat_map(|row| [row, &[0xee; 7]].concat()).collect();
        let told = tell(DEPTH, FAR, false, MOTION);
        let input =
            KeyInput { color: plane(&padded, 3, 2), depth: None, motion: None, ..input(&told) };
        let key = decode(&format, &input).unwrap().0;
        let mut bytes = Vec::new();
        key.color.write_bytes(&mut bytes);
        assert_eq!(bytes, pixels, "{color:?}");
    }
}

#[test]
fn a_motion_span_that_skips_keys_is_fine_and_one_that_points_forward_is_not() {
    let told = tell(DEPTH, FAR, false, MOTION);
    let long = KeyInput { motion_from: Some(at_ms(1)), ..input(&told) };
    let key = decode(&told.format, &long).unwrap().0;
    assert_eq!(key.motion_span(), Some(MonoSpan::from_ms(99)));
    for ms in [100, 101] {
        let forward = KeyInput { motion_from: Some(at_ms(ms)), ..input(&told) };
        let error = decode(&told.format, &forward).unwrap_err();
        assert!(matches!(error, DecodeError::MotionFrom { .. }), "{error}");
    }
}

/// What a test spoils in a good key, and the message it expects.
type Spoiled<'a> = (&'a str, &'a dyn Fn(&mut StreamFormat, &mut KeyInput<'_>));

#[test]
fn bad_numbers_are_refused_with_what_was_expected_and_what_was_found() {
    fn depth<'a, 'b>(input: &'a mut KeyInput<'b>) -> &'a mut PlaneInput<'b> {
        input.depth.as_mut().unwrap()
    }
    let told = tell(DEPTH, FAR, true, MOTION);
    let cases: &[Spoiled<'_>] = &[
        ("stream size: expected 1x1 to 8192x8192 pixels, found 0x8", &|format, _| format.width = 0),
        ("colour plane: expected 17x8 pixels, found 16x8", &|format, _| format.width = 17),
        ("depth plane: expected 1x1 to 8192x8192 pixels, found 0x8", &|_, input| {
            depth(input).width = 0;
        }),
        ("depth plane: expected 1x1 to 8192x8192 pixels, found 16x4294967295", &|_, input| {
            depth(input).height = u32::MAX;
        }),
        ("depth plane: expected a stride of at least 64 bytes, found 63", &|_, input| {
            depth(input).stride = 63;
        }),
        ("depth plane: expected at least 30064771129 bytes, found 512", &|_, input| {
            depth(input).stride = u32::MAX;
        }),
        ("colour plane: expected at least 512 bytes, found 511", &|_, input| {
            input.color.pixels = Pixels::Bytes(&COLOR[1..]);
        }),
        (
            "depth plane: expected a valid rectangle inside 16x8 pixels, found 16x8 at 1, 0",
            &|_, i| {
                depth(i).valid.x = 1;
            },
        ),
        (
            "colour plane: expected a valid rectangle inside 16x8 pixels, found 0x8 at 0, 0",
            &|_, i| {
                i.color.valid.width = 0;
            },
        ),
        ("depth plane: expected 4x2 to 16x8 valid pixels, found 3x8", &|_, input| {
            depth(input).valid.width = 3;
        }),
        ("depth plane: expected 2x1 to 8x4 valid pixels, found 16x8", &|_, input| {
            input.color.valid = Rect { x: 0, y: 0, width: 8, height: 4 };
        }),
        ("depth plane: expected a jitter within -1 to 1 pixel, found [NaN, 0.0]", &|_, input| {
            depth(input).jitter[0] = f32::NAN;
        }),
        (
            "depth plane: expected none, because the stream declares none; found one",
            &|format, _| {
                format.depth = None;
            },
        ),
        ("motion scale: expected finite numbers other than 0, found [0.0, 1.0]", &|format, _| {
            format.motion.as_mut().unwrap().scale[0] = 0.0;
        }),
        ("view matrix: expected finite elements, found NaN", &|_, input| {
            input.camera.as_mut().unwrap().view[3] = f32::NAN;
        }),
        ("projection matrix: expected finite elements, found inf", &|_, input| {
            input.camera.as_mut().unwrap().projection[15] = f32::INFINITY;
        }),
    ];
    for (message, spoil) in cases {
        let (mut format, mut input) = (told.format, input(&told));
        spoil(&mut format, &mut input);
        let error = decode(&format, &input).expect_err(message);
        assert_eq!(error.to_string(), *message);
    }
}

/// Memory that somebody else writes to: counts how often each byte is read.
#[derive(Debug)]
struct Shared<'a> {
    bytes: &'a [u8],
    reads: Vec<AtomicU32>,
}

impl<'a> Shared<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, reads: bytes.iter().map(|_| AtomicU32::new(0)).collect() }
    }
}

impl ReadPixels for Shared<'_> {
    fn byte_count(&self) -> u64 {
        self.bytes.len() as u64
    }

    fn read(&self, offset: u64, out: &mut [u8]) {
        let range = offset as usize..offset as usize + out.len();
        out.copy_from_slice(&self.bytes[range.clone()]);
        for reads in &self.reads[range] {
            reads.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[test]
fn what_is_read_out_of_shared_memory_is_read_once_and_gives_the_same_key() {
    let told = tell(DEPTH, FAR, true, MOTION);
    let pixels: Vec<u8> = (0..WIDTH * HEIGHT * 8).map(|i| (i % 113) as u8).collect();
    for color in [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f] {
        let format = StreamFormat { color, ..told.format };
        let color = &pixels[..(WIDTH * HEIGHT * color.bytes_per_pixel()) as usize];
        let planes = [color, &told.depth, &told.motion].map(Shared::new);
        let mut input = KeyInput { color: plane(color, WIDTH, HEIGHT), ..input(&told) };
        let (expected, _) = decode(&format, &input).unwrap();
        let [color, depth, motion] = planes.each_ref().map(|plane| Pixels::Reader(plane));
        input.color.pixels = color;
        input.depth.as_mut().unwrap().pixels = depth;
        input.motion.as_mut().unwrap().pixels = motion;
        let (found, _) = decode(&format, &input).unwrap();
        assert_eq!(found.color, expected.color);
        assert_eq!(found.depth, expected.depth);
        assert_eq!(found.velocity, expected.velocity);
        for reads in planes.iter().flat_map(|plane| &plane.reads) {
            assert_eq!(reads.load(Ordering::Relaxed), 1, "reads of a byte");
        }
    }
}

#[test]
fn motion_too_fast_to_follow_is_damped_only_when_the_viewing_distance_is_known() {
    // 3 pixels in 25 ms at 1 pixel per degree: 120 degrees per second, beyond all pursuit.
    let told = tell(DEPTH, FAR, false, MOTION);
    let mut key = KeyFrame::default();
    let mut scratch = DecodeScratch::default();
    let mut at = |pixels_per_degree| {
        let (format, input) = (&told.format, input(&told));
        decode_key(&pool(1), format, &input, pixels_per_degree, &mut scratch, &mut key).unwrap();
        key.velocity.at(0, 0)
    };
    assert_eq!(at(None), Velocity { x: -96, y: 48 });
    assert_eq!(at(Some(60.0)), Velocity { x: -96, y: 48 });
    assert_eq!(at(Some(1.0)), Velocity { x: 0, y: 0 });
    let slowed = at(Some(1.66));
    assert!((-95..0).contains(&slowed.x), "{slowed:?}");
}
