//! The user interface over pictures: by definition, at the borders of the output, by every method.

use std::num::NonZeroUsize;

use proptest::prelude::*;

use super::*;
use crate::color::{OrderedRgba16, Rgba8};
use crate::format::{
    CameraMotion, MotionConvention, MotionDirection, MotionFormat, MotionUnit, StreamFormat,
};
use crate::key::KeyInput;
use crate::testing::{noise, plane, pool, words};
use crate::{Engine, EngineConfig, Method, MonoSpan, MonoTime};

const FORMATS: [ColorFormat; 3] = [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f];

/// The layer that shows `valid` of `pixels` at `place`.
fn layer(pixels: &ColorPlane, valid: Rect, place: [i32; 2]) -> UiLayer {
    let mut bytes = Vec::new();
    pixels.write_bytes(&mut bytes);
    let (width, height, format) = (pixels.width(), pixels.height(), pixels.format());
    let packed = PlaneInput::packed(&bytes, [width, height], format.bytes_per_pixel());
    let input = UiInput { plane: PlaneInput { valid, ..packed }, place };
    let mut layer = UiLayer::default();
    layer.set(&pool(1), format, &input).unwrap();
    layer
}

fn whole(pixels: &ColorPlane) -> UiLayer {
    layer(pixels, Rect::full(pixels.width(), pixels.height()), [0; 2])
}

fn laid_over(ui: &UiLayer, picture: &ColorPlane, threads: usize) -> ColorPlane {
    let mut out = picture.clone();
    composite(&pool(threads), ui, &mut out);
    out
}

/// One `rgba8` pixel over another.
fn over(ui: [u8; 4], picture: [u8; 4]) -> [u8; 4] {
    let pixel = |bytes| ColorPlane::Rgba8(plane(1, 1, |_, _| Rgba8(u32::from_le_bytes(bytes))));
    words(&laid_over(&whole(&pixel(ui)), &pixel(picture), 1)).at(0, 0).to_le_bytes()
}

proptest! {
    #[test]
    fn a_pixel_is_the_nearest_level_to_what_is_left_and_what_lies_over_it(
        ui: [u8; 4], picture: [u8; 4],
    ) {
        let found = over(ui, picture);
        for channel in 0..4 {
            let [u, p, a] = [ui[channel], picture[channel], ui[3]].map(f64::from);
            let exact = u.min(a) + p * (255.0 - a) / 255.0;
            prop_assert!((f64::from(found[channel]) - exact).abs() <= 0.5, "{:?}", found);
        }
    }

    #[test]
    fn what_is_clear_leaves_the_picture_and_what_is_opaque_hides_it(
        ui: [u8; 3], picture: [u8; 4],
    ) {
        let [r, g, b] = ui;
        prop_assert_eq!(over([r, g, b, 0], picture), picture);
        prop_assert_eq!(over([r, g, b, 255], picture), [r, g, b, 255]);
    }
}

#[test]
fn in_every_format_clear_pixels_change_no_bit_and_opaque_ones_show_every_bit() {
    for format in FORMATS {
        let (picture, ui) = (noise(format, 40, 9, 1), noise(format, 40, 9, 2));
        let with_alpha = |full: bool| {
            let mut pixels = ui.clone();
            match &mut pixels {
                ColorPlane::Rgba8(plane) => plane.data_mut().iter_mut().for_each(|texel| {
                    texel.0 = texel.0 & 0x00ff_ffff | if full { 0xff << 24 } else { 0 };
                }),
                ColorPlane::Rgb10a2(plane) => plane.data_mut().iter_mut().for_each(|texel| {
                    texel.0 = texel.0 & 0x3fff_ffff | if full { 3 << 30 } else { 0 };
                }),
                ColorPlane::Rgba16f(plane) => plane.data_mut().iter_mut().for_each(|texel| {
                    let alpha = if full { 0x3c00 } else { 0 };
                    texel.0[3] = crate::color::half_to_ordered(alpha);
                }),
            }
            pixels
        };
        assert_eq!(laid_over(&whole(&with_alpha(false)), &picture, 2), picture, "{format:?}");
        let opaque = with_alpha(true);
        assert_eq!(laid_over(&whole(&opaque), &picture, 2), opaque, "{format:?}");
        // Of the comparison: noise in alpha shows something of both.
        let mixed = laid_over(&whole(&ui), &picture, 2);
        assert!(mixed != picture && mixed != ui, "{format:?}");
    }
}

#[test]
fn a_third_of_ten_bits_and_a_half_of_halves() {
    let word = |c: u32, a: u32| {
        ColorPlane::Rgb10a2(plane(1, 1, |_, _| crate::color::Rgb10a2(c | a << 30)))
    };
    let found = laid_over(&whole(&word(300, 1)), &word(1000, 3), 1);
    assert_eq!(found, word(300 + 667, 3), "alpha 1 of 3 leaves two thirds");
    let cut = laid_over(&whole(&word(1023, 1)), &word(0, 0), 1);
    assert_eq!(cut, word(341, 1), "colour is cut at alpha");
    let halves = |bits: [u16; 4]| {
        let texel = OrderedRgba16(bits.map(crate::color::half_to_ordered));
        ColorPlane::Rgba16f(plane(1, 1, |_, _| texel))
    };
    let (ui, picture) = ([0x4000, 0x3400, 0, 0x3800], [0x3c00, 0x3c00, 0x7bff, 0x3c00]);
    let found = laid_over(&whole(&halves(ui)), &halves(picture), 1);
    assert_eq!(found, halves([0x4100, 0x3a00, 0x77ff, 0x3c00]), "2 + 1/2, 1/4 + 1/2, 65504 / 2");
}

#[test]
fn it_lies_where_it_is_placed_and_ends_at_the_output_and_its_valid_rectangle() {
    let (width, height) = (23, 11);
    let picture = noise(ColorFormat::Rgba8, width, height, 1);
    let ui = ColorPlane::Rgba8(plane(9, 6, |x, y| Rgba8(0xff00_0000 | y << 8 | x)));
    let valid = Rect { x: 2, y: 1, width: 5, height: 4 };
    for place in [[0, 0], [4, 3], [-4, -3], [20, 8], [-9, 0], [23, 11], [8192, 0], [0, -8192]] {
        let found = words(&laid_over(&layer(&ui, valid, place), &picture, 3));
        let (ui, under) = (words(&ui), words(&picture));
        for y in 0..height {
            for x in 0..width {
                let [u, v] = [x.cast_signed() - place[0], y.cast_signed() - place[1]];
                let is_shown = (2..7).contains(&u) && (1..5).contains(&v);
                let expected = match is_shown {
                    true => ui.at(u.unsigned_abs(), v.unsigned_abs()),
                    false => under.at(x, y),
                };
                assert_eq!(found.at(x, y), expected, "{place:?}: {x}, {y}");
            }
        }
    }
}

#[test]
fn a_plane_that_is_not_whole_is_refused_and_the_one_before_stays() {
    let picture = noise(ColorFormat::Rgba8, 8, 8, 1);
    let mut ui = whole(&noise(ColorFormat::Rgba8, 8, 8, 2));
    let before = laid_over(&ui, &picture, 1);
    let short = UiInput { plane: PlaneInput::packed(&[0; 255], [8, 8], 4), place: [0; 2] };
    let error = ui.set(&pool(1), ColorFormat::Rgba8, &short).unwrap_err().to_string();
    assert!(error.contains("UI") && error.contains("255"), "{error}");
    assert_eq!(laid_over(&ui, &picture, 1), before);
}

const SIDE: u32 = 48;

/// What `method` shows 10 ms after its second key, 37 pixels per 25 ms to the right; `ui` comes
/// between the keys. The second picture is the key itself.
fn shown(method: Method, ui: Option<&[u8]>) -> [Vec<u8>; 2] {
    let convention = MotionConvention {
        format: MotionFormat::Rg32f,
        direction: MotionDirection::PreviousToCurrent,
        unit: MotionUnit::Pixels,
        scale: [1.0; 2],
        camera_motion: CameraMotion::Included,
    };
    let format = StreamFormat { motion: Some(convention), ..StreamFormat::rgba8(SIDE, SIDE) };
    let mut engine = Engine::new(format, EngineConfig::new(method, NonZeroUsize::MIN));
    let at = |ms| MonoTime::ZERO + MonoSpan::from_ms(ms);
    for (seed, ms) in [(1, 100), (2, 125)] {
        let mut color = Vec::new();
        noise(ColorFormat::Rgba8, SIDE, SIDE, seed).write_bytes(&mut color);
        let motion: Vec<u8> = [37.0_f32, 0.0]
            .repeat((SIDE * SIDE) as usize)
            .into_iter()
            .flat_map(f32::to_le_bytes)
            .collect();
        let packed = |bytes, pixel| PlaneInput::packed(bytes, [SIDE, SIDE], pixel);
        let input = KeyInput {
            index: u64::from(seed),
            content_time: at(ms),
            motion_from: Some(at(ms - 25)),
            is_cut: false,
            color: packed(&color, 4),
            depth: None,
            motion: Some(packed(&motion, 8)),
            mask: None,
            camera: None,
            motion_from_camera: None,
        };
        engine.push_key(&input).unwrap();
        if let Some(ui) = ui {
            engine.set_ui(&UiInput { plane: packed(ui, 4), place: [0; 2] }).unwrap();
        }
    }
    let times = if method.interpolates() { [115, 125] } else { [135, 125] };
    times.map(|ms| {
        let (mut out, mut bytes) = (ColorPlane::default(), Vec::new());
        engine.synthesise(at(ms), &mut out).unwrap();
        out.write_bytes(&mut bytes);
        bytes
    })
}

#[test]
fn no_method_moves_a_byte_of_it_or_of_what_it_leaves_free() {
    // A frame of opaque noise around a clear middle.
    let is_seen = |x: u32, y: u32| x < 7 || y < 5 || x > 40 || y > 40;
    let mut ui = Vec::new();
    let pixel = |x, y| crate::testing::hash(x, y, 77) | 0xff00_0000;
    let clear = |x, y| Rgba8(if is_seen(x, y) { pixel(x, y) } else { 0x00aa_bbcc });
    ColorPlane::Rgba8(plane(SIDE, SIDE, clear)).write_bytes(&mut ui);
    for method in Method::ALL {
        for (with, without) in shown(method, Some(&ui)).into_iter().zip(shown(method, None)) {
            let mut differs = false;
            for (i, (with, without)) in with.chunks(4).zip(without.chunks(4)).enumerate() {
                let (x, y) = (i as u32 % SIDE, i as u32 / SIDE);
                let expected = if is_seen(x, y) { &ui[4 * i..][..4] } else { without };
                assert_eq!(with, expected, "{method}: {x}, {y}");
                differs |= with != without;
            }
            // Of the comparison: without it the picture is another, there, too.
            assert!(differs, "{method}");
        }
    }
}
