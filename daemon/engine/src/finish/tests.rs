//! The laws of finishing: light is kept, flat pictures stay, every way makes the same bytes.

use foreframe_perception::compensation::LightTable;
use foreframe_perception::display::DisplayProfile;
use foreframe_perception::flicker::FlickerModel;
use foreframe_perception::plane::Plane as Luminance;
use proptest::prelude::*;

use super::lanes::{Wide, mixed};
use super::selection::{FULL, TILE, row_weights};
use super::*;
use crate::color::{ColorFormat, OrderedRgba16, Rgba8, Texel, half_to_ordered, ordered_to_half};
use crate::engine::start_pool;
use crate::format::Transfer;
use crate::key::Velocity;
use crate::plane::Plane;
use crate::simd::Simd;
use crate::testing::{hash, noise, plane, pool, px};
use crate::time::MonoSpan;

const FORMATS: [ColorFormat; 3] = [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f];

fn stream(color: ColorFormat, width: u32, height: u32) -> StreamFormat {
    let transfer = match color {
        ColorFormat::Rgba8 => Transfer::Srgb,
        ColorFormat::Rgb10a2 => Transfer::Pq,
        ColorFormat::Rgba16f => Transfer::Linear,
    };
    StreamFormat { color, transfer, ..StreamFormat::rgba8(width, height) }
}

fn on() -> FinishConfig {
    FinishConfig { mode: FinishMode::On, ..FinishConfig::default() }
}

fn of(format: &StreamFormat, config: &FinishConfig) -> Finish {
    Finish::new(format, config, Some(56.0)).unwrap()
}

fn finished(finish: &mut Finish, part: Part, picture: &ColorPlane) -> ColorPlane {
    let mut out = picture.clone();
    let valid = Rect::full(picture.width(), picture.height());
    finish.apply(&pool(1), part, valid, &mut out);
    out
}

/// Channels of every pixel.
fn channels(picture: &ColorPlane) -> Vec<[u16; 4]> {
    match picture {
        ColorPlane::Rgba8(plane) => plane.data().iter().map(|texel| texel.channels()).collect(),
        ColorPlane::Rgb10a2(plane) => plane.data().iter().map(|texel| texel.channels()).collect(),
        ColorPlane::Rgba16f(plane) => plane.data().iter().map(|texel| texel.channels()).collect(),
    }
}

/// A picture of patches and detail, as pictures are; every channel another.
fn scene(width: u32, height: u32, seed: u32) -> ColorPlane {
    ColorPlane::Rgba8(plane(width, height, |x, y| {
        let patch = hash(x / 9, y / 7, seed);
        let detail = hash(x, y, seed + 1);
        let channel = |shift: u32| {
            let base = i64::from(patch >> shift & 0xff);
            let swing = i64::from(detail >> shift & 0x3f) - 32;
            (base + swing).clamp(0, 255) as u16
        };
        Rgba8::of_channels([channel(0), channel(8), channel(16), channel(24)])
    }))
}

/// The definition of `pyramid/mod.rs`, pixel by pixel.
fn blurred_by_definition<T: Wide>(picture: &Plane<T>) -> Plane<T> {
    fn at<T: Wide>(plane: &Plane<T>, x: i64, y: i64) -> [u64; 4] {
        let x = x.clamp(0, i64::from(plane.width()) - 1) as u32;
        let y = y.clamp(0, i64::from(plane.height()) - 1) as u32;
        plane.at(x, y).channels().map(u64::from)
    }
    fn weighed<T: Wide>(from: &Plane<T>, xs: &[(i64, u64)], ys: &[(i64, u64)], shift: u32) -> T {
        let mut sum = [1_u64 << (shift - 1); 4];
        for &(y, of_y) in ys {
            for &(x, of_x) in xs {
                let channels = at(from, x, y);
                for (sum, channel) in sum.iter_mut().zip(channels) {
                    *sum += of_x * of_y * channel;
                }
            }
        }
        T::of_channels(sum.map(|sum| (sum >> shift) as u16))
    }
    let down = |fine: &Plane<T>| {
        plane(fine.width().div_ceil(2), fine.height().div_ceil(2), |x, y| {
            let taps = |at: u32| {
                [-1, 0, 1].map(|tap| (2 * i64::from(at) + tap, [1, 2, 1][(tap + 1) as usize]))
            };
            weighed(fine, &taps(x), &taps(y), 4)
        })
    };
    let up = |coarse: &Plane<T>, width: u32, height: u32| {
        plane(width, height, |x, y| {
            let taps = |at: u32| {
                let middle = i64::from(at / 2);
                match at % 2 {
                    0 => vec![(middle - 1, 1), (middle, 6), (middle + 1, 1)],
                    _ => vec![(middle, 4), (middle + 1, 4)],
                }
            };
            weighed(coarse, &taps(x), &taps(y), 6)
        })
    };
    let half = down(picture);
    let smooth = up(&down(&half), half.width(), half.height());
    up(&smooth, picture.width(), picture.height())
}

/// What `part` makes of `picture` by the definitions alone.
fn by_definition<T: Wide>(finish: &mut Finish, part: Part, picture: &Plane<T>) -> Vec<[u16; 4]> {
    let blurred = blurred_by_definition(picture);
    let split = finish.shares.of(part).unwrap();
    let pairs = picture.data().iter().zip(blurred.data());
    pairs.map(|(original, blurred)| split.of(*original, *blurred).channels()).collect()
}

const PARTS: [Part; 4] = [
    Part::Key { frames: 2 },
    Part::InBetween { frames: 2 },
    Part::Key { frames: 3 },
    Part::InBetween { frames: 3 },
];

#[test]
fn every_size_and_format_is_finished_as_defined() {
    for (seed, (width, height)) in
        (0..).zip([(1, 1), (2, 3), (8, 8), (9, 17), (31, 5), (64, 33), (67, 40)])
    {
        for format in FORMATS {
            for config in [
                on(),
                FinishConfig {
                    mode: FinishMode::Auto,
                    refresh_interval: MonoSpan::from_hz(120.0),
                    ..on()
                },
            ] {
                let picture = noise(format, width, height, seed);
                let mut finish = of(&stream(format, width, height), &config);
                for part in PARTS {
                    let expected = match &picture {
                        ColorPlane::Rgba8(plane) => by_definition(&mut finish, part, plane),
                        ColorPlane::Rgb10a2(plane) => by_definition(&mut finish, part, plane),
                        ColorPlane::Rgba16f(plane) => by_definition(&mut finish, part, plane),
                    };
                    let found = channels(&finished(&mut finish, part, &picture));
                    assert!(found == expected, "{part:?} of {width}x{height} {format:?}");
                    let is_changed = found != channels(&picture);
                    assert!(is_changed || config.mode == FinishMode::Auto || width * height == 1);
                }
            }
        }
    }
}

#[test]
fn threads_and_registers_make_no_difference() {
    for (seed, format) in (0..).zip(FORMATS) {
        let picture = noise(format, 203, 77, seed);
        let mut made = Vec::new();
        for (threads, simd) in [(1, Simd::Portable), (1, Simd::Widest), (4, Simd::Widest)] {
            let pool = start_pool(threads.try_into().unwrap(), simd, || ());
            let mut finish = of(&stream(format, 203, 77), &on());
            let valid = Rect { x: 3, y: 5, width: 190, height: 66 };
            let all = PARTS.map(|part| {
                let mut out = picture.clone();
                pool.install(|| finish.apply(&pool, part, valid, &mut out));
                out
            });
            made.push(all);
        }
        assert!(made.windows(2).all(|two| two[0] == two[1]), "{format:?}");
    }
}

#[test]
fn what_lies_outside_the_valid_rectangle_stays_and_is_not_blurred_in() {
    let valid = Rect { x: 4, y: 6, width: 40, height: 21 };
    let inside = |x: u32, y: u32| (4..44).contains(&x) && (6..27).contains(&y);
    let boxed = |outside: u32| {
        ColorPlane::Rgba8(plane(53, 31, |x, y| {
            Rgba8(if inside(x, y) { hash(x, y, 1) } else { outside })
        }))
    };
    let mut finish = of(&stream(ColorFormat::Rgba8, 53, 31), &on());
    for part in PARTS {
        let [mut dark, mut bright] = [0, u32::MAX].map(boxed);
        finish.apply(&pool(1), part, valid, &mut dark);
        finish.apply(&pool(1), part, valid, &mut bright);
        let (dark, bright) = (channels(&dark), channels(&bright));
        for (i, (dark, bright)) in dark.iter().zip(bright).enumerate() {
            let (x, y) = (i as u32 % 53, i as u32 / 53);
            match inside(x, y) {
                true => assert_eq!(*dark, bright),
                false => assert_eq!((*dark, bright), ([0; 4], [255; 4])),
            }
        }
    }
}

#[test]
fn a_flat_picture_stays_whatever_its_colour() {
    for format in FORMATS {
        for seed in 0..40 {
            let one = noise(format, 1, 1, seed);
            let flat = match &one {
                ColorPlane::Rgba8(one) => ColorPlane::Rgba8(plane(19, 13, |_, _| one.at(0, 0))),
                ColorPlane::Rgb10a2(one) => ColorPlane::Rgb10a2(plane(19, 13, |_, _| one.at(0, 0))),
                ColorPlane::Rgba16f(one) => ColorPlane::Rgba16f(plane(19, 13, |_, _| one.at(0, 0))),
            };
            let mut finish = of(&stream(format, 19, 13), &on());
            for part in PARTS {
                assert_eq!(finished(&mut finish, part, &flat), flat, "{part:?}");
            }
        }
    }
}

#[test]
fn alpha_stays_and_a_plain_picture_too() {
    let picture = scene(40, 30, 3);
    let mut finish = of(&stream(ColorFormat::Rgba8, 40, 30), &on());
    assert_eq!(finished(&mut finish, Part::Plain, &picture), picture);
    for part in PARTS {
        let made = finished(&mut finish, part, &picture);
        assert_ne!(made, picture);
        for (made, before) in channels(&made).iter().zip(channels(&picture)) {
            assert_eq!(made[3], before[3]);
        }
    }
}

/// Light of each picture summed, minus that of as many originals, with what half a level of each
/// picture comes to.
fn excess(
    tables: &[LightTable; 3],
    pictures: &[ColorPlane],
    original: &ColorPlane,
) -> Vec<[i64; 2]> {
    let original = channels(original);
    let mut sums = vec![[0, 0]; 3 * original.len()];
    for picture in pictures {
        for (pixel, (shown, original)) in channels(picture).iter().zip(&original).enumerate() {
            for (channel, table) in tables.iter().enumerate() {
                let [sum, allowed] = &mut sums[3 * pixel + channel];
                let light = |level| i64::from(table.light(level));
                *sum += light(shown[channel]) - light(original[channel]);
                *allowed += i64::from(table.half_level(shown[channel])) + 1;
            }
        }
    }
    sums
}

#[test]
fn the_test_of_light_finds_a_key_for_another_number_of_frames() {
    let picture = scene(48, 32, 5);
    let format = stream(ColorFormat::Rgba8, 48, 32);
    let tables = [(); 3].map(|()| {
        LightTable::new(256, foreframe_perception::display::transfer::srgb_to_linear).unwrap()
    });
    let mut finish = of(&format, &on());
    let mut made = |parts: &[Part]| -> Vec<ColorPlane> {
        parts.iter().map(|part| finished(&mut finish, *part, &picture)).collect()
    };
    let between = Part::InBetween { frames: 3 };
    let right = made(&[Part::Key { frames: 3 }, between, between]);
    let is_kept = |sums: Vec<[i64; 2]>| sums.iter().all(|[sum, allowed]| sum.abs() <= *allowed);
    assert!(is_kept(excess(&tables, &right, &picture)));
    let wrong = made(&[Part::Key { frames: 2 }, between, between]);
    assert!(!is_kept(excess(&tables, &wrong, &picture)));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn the_light_of_n_frames_is_that_of_n_originals_within_half_a_level_each(
        seed: u32,
        (width, height) in (1_u32..40, 1_u32..30),
        frames in 2_u32..=9,
        gamma in prop::array::uniform3(1.0_f64..2.8),
        profile in prop::option::of(0_usize..7),
        is_auto: bool,
    ) {
        let gamma = match profile {
            Some(index) => DisplayProfile::builtins().nth(index).unwrap().model().gamma(),
            None => gamma,
        };
        let tables = gamma.map(|gamma| LightTable::new(256, |code| libm::pow(code, gamma)).unwrap());
        let picture = match seed % 2 {
            0 => scene(width, height, seed),
            _ => noise(ColorFormat::Rgba8, width, height, seed),
        };
        let mode = if is_auto { FinishMode::Auto } else { FinishMode::On };
        let refresh_interval = MonoSpan::from_hz(120.0);
        let config =
            FinishConfig { mode, gamma: Some(gamma), refresh_interval, ..FinishConfig::default() };
        let mut finish = of(&stream(ColorFormat::Rgba8, width, height), &config);
        let parts = (0..frames).map(|index| match index {
            0 => Part::Key { frames },
            _ => Part::InBetween { frames },
        });
        let shown: Vec<_> = parts.map(|part| finished(&mut finish, part, &picture)).collect();
        for [sum, allowed] in excess(&tables, &shown, &picture) {
            prop_assert!(sum.abs() <= allowed, "off by {sum}, {allowed} are allowed");
        }
    }

    /// Halves stand for light to a two-thousandth, so that what is left is what the split itself
    /// does: before quantisation.
    #[test]
    fn before_quantisation_light_is_kept_to_half_a_percent_where_nothing_clips(
        seed: u32,
        frames in 2_u32..=6,
    ) {
        let picture = ColorPlane::Rgba16f(plane(24, 20, |x, y| {
            OrderedRgba16(std::array::from_fn(|channel| {
                let value = hash(x, y, seed.wrapping_add(channel as u32)) as f32 / u32::MAX as f32;
                half_to_ordered(half::f16::from_f32(0.05 + 0.95 * value).to_bits())
            }))
        }));
        let light = |level| half::f16::from_bits(ordered_to_half(level)).to_f64();
        let mut finish = of(&stream(ColorFormat::Rgba16f, 24, 20), &on());
        let key = channels(&finished(&mut finish, Part::Key { frames }, &picture));
        let between = channels(&finished(&mut finish, Part::InBetween { frames }, &picture));
        let mut unclipped = 0;
        for ((key, between), original) in key.iter().zip(&between).zip(channels(&picture)) {
            for channel in 0..3 {
                let [key, between, original] =
                    [key[channel], between[channel], original[channel]].map(light);
                if key > 0.0 && key < 1.0 {
                    unclipped += 1;
                    let total = f64::from(frames) * original;
                    let sum = key + f64::from(frames - 1) * between;
                    prop_assert!((sum - total).abs() <= 0.005 * total, "{sum} for {total}");
                }
            }
        }
        prop_assert!(unclipped > 100, "{unclipped}");
    }

    #[test]
    fn light_is_kept_but_for_what_is_outstanding_however_many_frames_come(
        seed: u32,
        counts in prop::collection::vec(0_u32..7, 2..12),
    ) {
        let picture = scene(20, 14, seed);
        let tables = [(); 3].map(|()| LightTable::new(256, |code| libm::pow(code, 2.2)).unwrap());
        let config = FinishConfig { gamma: Some([2.2; 3]), ..on() };
        let mut finish = of(&stream(ColorFormat::Rgba8, 20, 14), &config);
        let mut shown = Vec::new();
        for count in counts {
            finish.ledger.on_key(false);
            for _ in 0..count {
                let part = finish.ledger.next_part();
                shown.push(finished(&mut finish, part, &picture));
            }
        }
        // What was paid for is delivered, and then nothing more is changed.
        while finish.ledger.outstanding() > 0 {
            let part = finish.ledger.next_part();
            shown.push(finished(&mut finish, part, &picture));
        }
        for [sum, allowed] in excess(&tables, &shown, &picture) {
            prop_assert!(sum.abs() <= allowed, "off by {sum}, {allowed} are allowed");
        }
    }
}

/// Weights of every kind: none, all and some, in runs of several tiles.
fn weights_of(width: u32, height: u32, seed: u32) -> Plane<u8> {
    plane(width.div_ceil(TILE), height.div_ceil(TILE), |x, y| match hash(x / 3, y / 2, seed) % 4 {
        0 | 1 => 0,
        2 => FULL,
        _ => (hash(x, y, seed) % 129) as u8,
    })
}

fn still(weights: &Plane<u8>) -> Plane<Velocity> {
    plane(weights.width(), weights.height(), |_, _| Velocity::default())
}

fn select(finish: &mut Finish, weights: Plane<u8>) {
    let (motion, older) = (still(&weights), finish.ledger.oldest_age());
    let selection = finish.selection.as_mut().unwrap();
    selection.take_weights(weights, motion, Some(Phase::ZERO), older);
}

#[test]
fn a_selection_is_blurred_as_defined_in_every_format_and_by_every_register() {
    fn expected<T: Wide>(
        finish: &mut Finish,
        part: Part,
        picture: &Plane<T>,
        weights: &Plane<u8>,
    ) -> Vec<[u16; 4]> {
        let blurred = blurred_by_definition(picture);
        let split = finish.shares.of(part).unwrap();
        let mut row = vec![0; picture.width() as usize];
        let rows = (0..picture.height()).flat_map(|y| {
            row_weights(weights, y, &mut Vec::new(), &mut row);
            let pixels = picture.row(y).iter().zip(blurred.row(y)).zip(&row);
            pixels
                .map(|((original, blurred), weight)| {
                    split.of(*original, mixed(*original, *blurred, *weight)).channels()
                })
                .collect::<Vec<_>>()
        });
        rows.collect()
    }
    let (width, height) = (203, 77);
    for (seed, format) in (0..).zip(FORMATS) {
        let picture = noise(format, width, height, seed);
        let weights = weights_of(width, height, seed);
        for simd in [Simd::Portable, Simd::Widest] {
            let pool = start_pool(std::num::NonZeroUsize::MIN, simd, || ());
            let mut finish = of(&stream(format, width, height), &on());
            select(&mut finish, weights.clone());
            finish.turn_to(Phase::ZERO, 0);
            for part in PARTS {
                let mut made = picture.clone();
                let valid = Rect::full(width, height);
                pool.install(|| finish.apply(&pool, part, valid, &mut made));
                let expected = match &picture {
                    ColorPlane::Rgba8(plane) => expected(&mut finish, part, plane, &weights),
                    ColorPlane::Rgb10a2(plane) => expected(&mut finish, part, plane, &weights),
                    ColorPlane::Rgba16f(plane) => expected(&mut finish, part, plane, &weights),
                };
                assert!(channels(&made) == expected, "{part:?} of {format:?} by {simd:?}");
                assert_ne!(made, picture);
            }
        }
    }
}

#[test]
fn nothing_selected_is_nothing_changed_and_all_selected_is_the_whole_picture() {
    let picture = scene(90, 50, 8);
    let format = stream(ColorFormat::Rgba8, 90, 50);
    let whole = FinishConfig { is_whole: true, ..on() };
    let [mut selected, mut whole] = [on(), whole].map(|config| of(&format, &config));
    for (weight, is_changed) in [(0, false), (FULL, true)] {
        select(&mut selected, plane(12, 7, |_, _| weight));
        selected.turn_to(Phase::ZERO, 0);
        for part in PARTS {
            let made = finished(&mut selected, part, &picture);
            assert_eq!(made != picture, is_changed);
            assert_eq!(made == finished(&mut whole, part, &picture), is_changed);
        }
    }
}

/// Excess light, relative to that of the picture, along the path of a texture that moves by `step`
/// pixels a frame, three frames to a key; `is_moved` says whether the selection moves along.
fn excess_along_the_path(step: u32, weights: Plane<u8>, is_moved: bool) -> f64 {
    let (width, height, frames) = (256, 64, 3);
    let texture = |x: i64, y: u32| {
        let level = 60 + (hash(x as u32, y, 3) % 120) as u16;
        Rgba8::of_channels([level, level, level, 255])
    };
    let at = |moved: u32| {
        ColorPlane::Rgba8(plane(width, height, |x, y| texture(i64::from(x) - i64::from(moved), y)))
    };
    let format = stream(ColorFormat::Rgba8, width, height);
    let mut finish = of(&format, &FinishConfig { gamma: Some([2.2; 3]), ..on() });
    let velocity = px((step * frames) as f32, 0.0);
    let motion = plane(width / TILE, height / TILE, |_, _| velocity);
    finish.selection.as_mut().unwrap().take_weights(weights, motion, None, 0);
    let table = LightTable::new(256, |code| libm::pow(code, 2.2)).unwrap();
    let mut excess = vec![0_i64; (width * height) as usize];
    for frame in 0..frames {
        let part = if frame == 0 { Part::Key { frames } } else { Part::InBetween { frames } };
        let phase = if is_moved { f64::from(frame) / f64::from(frames) } else { 0.0 };
        finish.turn_to(Phase::from_f64(phase), 0);
        let original = at(frame * step);
        let [shown, original] =
            [channels(&finished(&mut finish, part, &original)), channels(&original)];
        for y in 0..height {
            for x in 40..200 {
                let pixel = (y * width + x + frame * step) as usize;
                let light = |levels: &[[u16; 4]]| i64::from(table.light(levels[pixel][0]));
                excess[(y * width + x) as usize] += light(&shown) - light(&original);
            }
        }
    }
    let total: f64 = excess.iter().map(|excess| excess.abs() as f64).sum();
    total / f64::from(160 * height) / f64::from(table.light(120)) / f64::from(frames)
}

#[test]
fn light_is_kept_along_the_path_of_what_moves_because_the_selection_moves_with_it() {
    let patch = || {
        plane(32, 8, |x, _| match x {
            8..16 => FULL,
            7 | 16 => FULL / 2,
            _ => 0,
        })
    };
    for step in [3, 8] {
        // What the blur itself, which is made anew for every frame, loses of a moving texture.
        let whole = excess_along_the_path(step, plane(32, 8, |_, _| FULL), true);
        let [moved, fixed] =
            [true, false].map(|is_moved| excess_along_the_path(step, patch(), is_moved) - whole);
        assert!(moved < 0.003, "{step} pixels a frame: {moved}, beside {whole}");
        assert!(fixed > 0.005 && fixed > 3.0 * moved, "{step} pixels a frame: {fixed}, {moved}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn light_is_kept_whatever_each_key_selects_and_however_many_frames_come(
        seed: u32,
        counts in prop::collection::vec(0_u32..7, 2..10),
    ) {
        let picture = scene(44, 30, seed);
        let tables = [(); 3].map(|()| LightTable::new(256, |code| libm::pow(code, 2.2)).unwrap());
        let config = FinishConfig { gamma: Some([2.2; 3]), ..on() };
        let mut finish = of(&stream(ColorFormat::Rgba8, 44, 30), &config);
        let mut shown = Vec::new();
        let mut owed_before_any = false;
        for (key, count) in (0..).zip(counts) {
            finish.ledger.on_key(false);
            select(&mut finish, weights_of(44, 30, seed.wrapping_add(key)));
            for _ in 0..count {
                let part = finish.next_part(Phase::ZERO);
                owed_before_any |= finish.ledger.age() > 3;
                shown.push(finished(&mut finish, part, &picture));
            }
        }
        while finish.ledger.outstanding() > 0 {
            let part = finish.next_part(Phase::ZERO);
            owed_before_any |= finish.ledger.age() > 3;
            shown.push(finished(&mut finish, part, &picture));
        }
        // Weights of keys further back than are kept are not exact, and are not promised to be.
        prop_assume!(!owed_before_any);
        for [sum, allowed] in excess(&tables, &shown, &picture) {
            prop_assert!(sum.abs() <= allowed, "off by {sum}, {allowed} are allowed");
        }
    }
}

/// Luminance of a picture on `profile`.
fn luminance(profile: &DisplayProfile, picture: &ColorPlane) -> Luminance {
    let levels = channels(picture);
    let width = picture.width() as usize;
    Luminance::from_fn(width, picture.height() as usize, |x, y| {
        let [r, g, b, _] = levels[y * width + x].map(|level| f64::from(level) / 255.0);
        profile.model().luminance([r, g, b]) as f32
    })
}

/// Pictures that flicker as much as pictures can: stripes of full contrast at several widths.
fn stripes(width: u32) -> ColorPlane {
    ColorPlane::Rgba8(plane(160, 96, |x, _| {
        Rgba8(if (x / width).is_multiple_of(2) { 0 } else { 0xff_ff_ff })
    }))
}

#[test]
fn auto_is_below_the_threshold_of_flicker_where_on_is_above() {
    let profile = DisplayProfile::builtin("asus-pg279q").unwrap();
    let mut pictures =
        vec![scene(160, 96, 1), scene(160, 96, 2), noise(ColorFormat::Rgba8, 160, 96, 3)];
    pictures.extend([1, 2, 3, 5, 8, 16].map(stripes));
    let grey = |low: u16, high: u16| {
        ColorPlane::Rgba8(plane(160, 96, move |x, y| {
            let level = if (x / 3 + y / 4) % 2 == 0 { low } else { high };
            Rgba8::of_channels([level, level, level, 255])
        }))
    };
    pictures.extend([grey(90, 160), grey(190, 250), grey(0, 90), grey(120, 255)]);
    for (rate, frames, ppd) in
        [(120.0, 3, 52.0), (120.0, 2, 52.0), (90.0, 2, 30.0), (144.0, 4, 80.0)]
    {
        let model = FlickerModel::new(rate, ppd).unwrap().repeating_after(frames).unwrap();
        let mut highest = [0.0_f32; 2];
        let mut changed = [0; 2];
        let modes = [FinishMode::Auto, FinishMode::On];
        for ((highest, changed), mode) in highest.iter_mut().zip(&mut changed).zip(modes) {
            let config = FinishConfig::new(mode, Some(&profile), MonoSpan::from_hz(rate));
            let format = stream(ColorFormat::Rgba8, 160, 96);
            let mut finish = Finish::new(&format, &config, Some(ppd as f32)).unwrap();
            for picture in &pictures {
                let [key, between] = [Part::Key { frames }, Part::InBetween { frames }]
                    .map(|part| finished(&mut finish, part, picture));
                *changed += usize::from(key != *picture);
                let [key, between] = [key, between].map(|made| luminance(&profile, &made));
                *highest = highest.max(model.map(&key, &between).unwrap().max());
            }
        }
        let [auto, on] = highest;
        assert!(auto < 0.5, "{rate} Hz, {frames} frames, {ppd} ppd: {auto}");
        assert!(auto <= on, "{auto} {on}");
        assert!(changed[0] == changed[1] && changed[0] > 6, "auto still finishes: {changed:?}");
        if frames > 2 {
            assert!(on > 0.5, "{rate} Hz, {frames} frames: {on}");
        }
    }
}

#[test]
fn auto_without_a_refresh_rate_does_nothing() {
    let picture = scene(40, 30, 3);
    let config = FinishConfig { mode: FinishMode::Auto, ..FinishConfig::default() };
    let mut finish = of(&stream(ColorFormat::Rgba8, 40, 30), &config);
    for part in PARTS {
        assert_eq!(finished(&mut finish, part, &picture), picture);
    }
    let off = FinishConfig::default();
    assert!(Finish::new(&stream(ColorFormat::Rgba8, 40, 30), &off, None).is_none());
}

#[test]
fn light_beyond_white_and_numbers_that_are_none_are_no_display_light() {
    let wild = |bits: u16| {
        ColorPlane::Rgba16f(plane(17, 9, move |x, y| {
            let other = hash(x, y, 1) as u16 & 0x3bff;
            OrderedRgba16([half_to_ordered(if (x + y) % 2 == 0 { bits } else { other }); 4])
        }))
    };
    let mut finish = of(&stream(ColorFormat::Rgba16f, 17, 9), &on());
    let one = half_to_ordered(0x3c00);
    for bits in [0x7bff, 0x4000, 0xfbff, 0x8000, 0x0001] {
        let picture = wild(bits);
        for part in PARTS {
            let made = channels(&finished(&mut finish, part, &picture));
            for (made, original) in made.iter().zip(channels(&picture)) {
                for channel in 0..3 {
                    let is_kept = made[channel] == original[channel];
                    let is_blur = matches!(part, Part::InBetween { .. });
                    assert!(is_kept || is_blur || made[channel] <= one, "{made:?} of {bits:x}");
                }
            }
        }
    }
}
