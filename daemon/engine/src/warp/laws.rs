//! Laws that every moving method obeys, whatever it does between them.

use proptest::prelude::*;

use crate::color::{ColorFormat, ColorPlane, Rgba8};
use crate::key::Velocity;
use crate::method::Method;
use crate::phase::Phase;
use crate::plane::Plane;
use crate::testing::{hash, key, noise, plane, px, warp, words};

const MOVING: [Method; 2] = [Method::Gather, Method::Linear];
const FORMATS: [ColorFormat; 3] = [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f];

/// A field of noise: every cell another depth and a velocity of up to `reach` pixels.
fn wild(width: u32, height: u32, reach: u32, seed: u32) -> (Plane<u32>, Plane<Velocity>) {
    let depth = plane(width, height, |x, y| hash(x, y, seed ^ 0x55));
    let steps = reach * 64 + 1;
    let velocity = plane(width, height, |x, y| {
        let v = |axis: u32| (hash(x, y, seed + axis) % steps) as i16 - (reach * 32) as i16;
        Velocity { x: v(1), y: v(2) }
    });
    (depth, velocity)
}

#[test]
fn zero_motion_is_identity_in_every_format_and_at_every_ratio() {
    for method in MOVING {
        for format in FORMATS {
            for (cells_x, cells_y) in [(17, 9), (9, 5), (11, 6), (5, 3)] {
                let color = noise(format, 17, 9, 3);
                let depth = plane(cells_x, cells_y, |x, y| hash(x, y, 1));
                let key = key(color.clone(), depth, Plane::new(cells_x, cells_y));
                assert_eq!(warp(2, method, &key, Phase::MAX).0, color, "{method} {format:?}");
            }
        }
    }
}

#[test]
fn phase_0_returns_the_key_whatever_the_field() {
    for method in MOVING {
        for format in FORMATS {
            let color = noise(format, 21, 13, 5);
            let (depth, velocity) = wild(11, 7, 9, 8);
            let key = key(color.clone(), depth, velocity);
            assert_eq!(warp(2, method, &key, Phase::ZERO).0, color, "{method} {format:?}");
        }
    }
}

#[test]
fn untrackable_surfaces_are_held() {
    for method in MOVING {
        let color = noise(ColorFormat::Rgba8, 16, 16, 1);
        let velocity = plane(8, 8, |_, _| Velocity::UNTRACKABLE);
        let key = key(color.clone(), plane(8, 8, |_, _| 7), velocity);
        assert_eq!(warp(1, method, &key, Phase::MAX).0, color, "{method}");
    }
}

#[test]
fn a_whole_pixel_translation_is_a_shift_inside_the_border() {
    let (width, height) = (31, 23);
    for method in MOVING {
        for (cells_x, cells_y) in [(31, 23), (16, 12), (20, 15), (8, 6)] {
            for (vx, vy) in [(3, 0), (-2, 5), (0, -4), (7, 7)] {
                let color = noise(ColorFormat::Rgba8, width, height, 2);
                let velocity = plane(cells_x, cells_y, |_, _| px(vx as f32, vy as f32));
                let key = key(color.clone(), plane(cells_x, cells_y, |_, _| 900), velocity);
                let out = words(&warp(2, method, &key, Phase::ONE).0);
                let color = words(&color);
                for y in 0..height as i32 {
                    for x in 0..width as i32 {
                        let (from_x, from_y) = (x - vx, y - vy);
                        if (0..width as i32).contains(&from_x)
                            && (0..height as i32).contains(&from_y)
                        {
                            assert_eq!(
                                out.at(x as u32, y as u32),
                                color.at(from_x as u32, from_y as u32),
                                "{method}, {cells_x} cells, moved by {vx}, {vy}, at {x}, {y}"
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn pixels_outside_the_valid_rectangle_are_shown_as_they_are() {
    for method in MOVING {
        let color = noise(ColorFormat::Rgba8, 24, 20, 4);
        let mut key = key(color.clone(), plane(8, 7, |_, _| 9), plane(8, 7, |_, _| px(5.0, 3.0)));
        key.valid = crate::plane::Rect { x: 3, y: 4, width: 16, height: 13 };
        let out = words(&warp(2, method, &key, Phase::ONE).0);
        let color = words(&color);
        let mut moved = 0;
        for y in 0..20 {
            for x in 0..24 {
                if (3..19).contains(&x) && (4..17).contains(&y) {
                    moved += u32::from(out.at(x, y) != color.at(x, y));
                } else {
                    assert_eq!(out.at(x, y), color.at(x, y), "{method} at {x}, {y}");
                }
            }
        }
        assert!(moved > 100, "{method} moved {moved} pixels of the rectangle");
        assert_eq!(out.at(8, 7), color.at(3, 4), "{method} moved by its own motion");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_constant_picture_stays_constant(
        (width, height) in (1_u32..40, 1_u32..30),
        seed: u32,
        phase in 0.0..4.0,
    ) {
        let (depth, velocity) = wild(width.div_ceil(2), height.div_ceil(3), 20, seed);
        let color = ColorPlane::Rgba8(plane(width, height, |_, _| Rgba8(0x8040_20ff)));
        let key = key(color.clone(), depth, velocity);
        for method in MOVING {
            let (out, _) = warp(2, method, &key, Phase::from_f64(phase));
            prop_assert_eq!(&out, &color, "{}", method);
        }
    }

    #[test]
    fn any_number_of_threads_makes_the_same_bytes(
        (width, height) in (1_u32..70, 1_u32..200),
        reach in 0_u32..40,
        seed: u32,
        phase in 0.0..4.0,
    ) {
        let (depth, velocity) = wild(width.div_ceil(2), height.div_ceil(2), reach, seed);
        let key = key(noise(ColorFormat::Rgba8, width, height, seed), depth, velocity);
        for method in MOVING {
            let phase = Phase::from_f64(phase);
            let (alone, _) = warp(1, method, &key, phase);
            for threads in 2..=5 {
                let (shared, _) = warp(threads, method, &key, phase);
                prop_assert!(shared == alone, "{} on {} threads", method, threads);
            }
        }
    }

    #[test]
    fn every_channel_stays_within_the_range_of_the_key(
        (width, height) in (1_u32..40, 1_u32..30),
        seed: u32,
        phase in 0.0..4.0,
    ) {
        let (depth, velocity) = wild(width, height, 10, seed);
        let color = ColorPlane::Rgba8(plane(width, height, |x, y| {
            Rgba8((hash(x, y, seed) & 0x3f3f_3f3f) + 0x2010_4030)
        }));
        let key = key(color.clone(), depth, velocity);
        let range = |color: &ColorPlane, shift: u32| {
            let words = words(color);
            let channel = words.data().iter().map(|word| (word >> shift) & 0xff);
            (channel.clone().min(), channel.max())
        };
        for method in MOVING {
            let (out, _) = warp(1, method, &key, Phase::from_f64(phase));
            for shift in [0, 8, 16, 24] {
                let (from, to) = (range(&color, shift), range(&out, shift));
                prop_assert!(from.0 <= to.0 && to.1 <= from.1, "{}: {:?} {:?}", method, from, to);
            }
        }
    }
}
