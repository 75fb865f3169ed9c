//! What the linear method shows where surfaces move apart.

mod memory;

use super::{LinearScratch, warp_linear};
use crate::color::{ColorFormat, ColorPlane, Rgba8};
use crate::key::KeyFrame;
use crate::method::Method;
use crate::phase::Phase;
use crate::plane::Plane;
use crate::testing::{hash, key, map_of, noise, plane, pool, px, warp, words};
use crate::time::MonoTime;

const WIDTH: u32 = 64;
const HEIGHT: u32 = 32;
const NEAR: u32 = 0xff00_00ff;
const FAR: u32 = 1000;

/// Whether pixel (x, y) shows the near square, which is `size` pixels wide.
fn is_near(x: u32, y: u32, size: u32) -> bool {
    (24..24 + size).contains(&x) && (8..8 + size).contains(&y)
}

/// A near square that moves before far texture without any red; field at 1 / `ratio`.
fn square(ratio: u32, size: u32, v: (f32, f32)) -> KeyFrame {
    let color = ColorPlane::Rgba8(plane(WIDTH, HEIGHT, |x, y| {
        Rgba8(if is_near(x, y, size) { NEAR } else { 0xff00_0000 | (hash(x, y, 3) & 0x00ff_ff00) })
    }));
    let (columns, rows) = (WIDTH / ratio, HEIGHT / ratio);
    let near = |x: u32, y: u32| is_near(x * ratio, y * ratio, size);
    let depth = plane(columns, rows, |x, y| if near(x, y) { 1_000_000 } else { FAR });
    // Dilated by one cell, as decode leaves it.
    let velocity = plane(columns, rows, |x, y| {
        let beside = (0..3)
            .any(|j| (0..3).any(|i| (x + i > 0) && (y + j > 0) && near(x + i - 1, y + j - 1)));
        if beside { px(v.0, v.1) } else { px(0.0, 0.0) }
    });
    key(color, depth, velocity)
}

#[test]
fn a_hole_shows_neither_the_nearer_surface_nor_a_mixture_with_it() {
    for ratio in [1, 2, 4] {
        for v in [(12.0, 0.0), (-9.5, 0.0), (0.0, 7.25), (6.0, -5.0), (30.0, 0.0), (-60.0, 20.0)] {
            let key = square(ratio, 8, v);
            let out = words(&warp(2, Method::Linear, &key, Phase::ONE).0);
            for y in 0..HEIGHT {
                for x in 0..WIDTH {
                    // Farther than a cell and a pixel from where the square went.
                    let margin = (2 * ratio + 1) as f32;
                    let apart = |at: u32, start: f32| {
                        (at as f32) < start - margin || at as f32 > start + 8.0 + margin
                    };
                    if apart(x, 24.0 + v.0) || apart(y, 8.0 + v.1) {
                        let red = out.at(x, y) & 0xff;
                        assert_eq!(red, 0, "ratio 1/{ratio}, moved by {v:?}, at {x}, {y}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_square_itself_arrives_whole() {
    for ratio in [1, 2, 4] {
        for (vx, vy) in [(12, 0), (-8, 4), (4, -4)] {
            let key = square(ratio, 8, (vx as f32, vy as f32));
            let out = words(&warp(2, Method::Linear, &key, Phase::ONE).0);
            for y in 8..16_i32 {
                for x in 24..32_i32 {
                    let at = ((x + vx) as u32, (y + vy) as u32);
                    assert_eq!(out.at(at.0, at.1), NEAR, "1/{ratio}, {vx}, {vy}, at {at:?}");
                }
            }
        }
    }
}

#[test]
fn a_pixel_of_the_hole_is_a_pixel_of_the_far_surface() {
    let key = square(1, 8, (16.0, 0.0));
    let (out, scratch) = warp(1, Method::Linear, &key, Phase::ONE);
    let (out, before) = (words(&out), words(&key.color));
    let mut holes = 0;
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            if scratch.is_hole(x, y) {
                holes += 1;
                let far = before.data().iter().zip(key.depth.data());
                let is_far = far.into_iter().any(|(c, depth)| *c == out.at(x, y) && *depth == FAR);
                assert!(is_far, "at {x}, {y}: {:08x}", out.at(x, y));
            }
        }
    }
    // The square and its dilated outline, 10x10, leave everything they covered.
    assert_eq!(holes, 100);
}

#[test]
fn what_comes_in_over_the_border_continues_the_far_side_at_the_border() {
    // Everything pans right but a near block at the left border, which stays where it is.
    let near = |x: u32, y: u32| x < 4 && (8..16).contains(&y);
    let color = ColorPlane::Rgba8(plane(WIDTH, HEIGHT, |x, y| {
        Rgba8(if near(x, y) { NEAR } else { 0xff00_0000 | (hash(x, y, 5) & 0x00ff_ff00) })
    }));
    let depth = plane(WIDTH, HEIGHT, |x, y| if near(x, y) { 1_000_000 } else { FAR });
    let velocity = plane(WIDTH, HEIGHT, |x, y| {
        let beside = x < 5 && (7..17).contains(&y);
        if beside { px(0.0, 0.0) } else { px(10.0, 0.0) }
    });
    let key = key(color, depth, velocity);
    let out = words(&warp(2, Method::Linear, &key, Phase::ONE).0);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            if !(x < 6 && (6..18).contains(&y)) {
                assert_eq!(out.at(x, y) & 0xff, 0, "the near block shows at {x}, {y}");
            }
        }
    }
    let before = words(&key.color);
    for x in 0..10 {
        assert_eq!(out.at(x, 2), before.at(0, 2), "the border pixel, stretched, at {x}");
    }
}

#[test]
fn a_field_coarser_than_colour_does_not_blur_two_surfaces_into_one() {
    // Two halves that slide past each other, moved by whole pixels: every output pixel is one of
    // the key's own, none a mean of two.
    let color = noise(ColorFormat::Rgba8, WIDTH, HEIGHT, 11);
    for ratio in [2, 4] {
        let (columns, rows) = (WIDTH / ratio, HEIGHT / ratio);
        let depth = plane(columns, rows, |_, y| if y < rows / 2 { 1_000_000 } else { FAR });
        let velocity =
            plane(columns, rows, |_, y| px(if y < rows / 2 + 1 { 6.0 } else { -5.0 }, 0.0));
        let key = key(color.clone(), depth, velocity);
        let out = words(&warp(1, Method::Linear, &key, Phase::ONE).0);
        let known: std::collections::BTreeSet<u32> = words(&color).data().iter().copied().collect();
        assert!(out.data().iter().all(|pixel| known.contains(pixel)), "1/{ratio}");
    }
}

#[test]
fn without_depth_the_faster_surface_is_taken_as_nearer() {
    let mut key = square(1, 8, (20.0, 0.0));
    key.depth = Plane::default();
    let out = words(&warp(1, Method::Linear, &key, Phase::ONE).0);
    for y in 8..16 {
        for x in 44..52 {
            assert_eq!(out.at(x, y), NEAR, "the square arrives at {x}, {y}");
        }
        for x in 23..33 {
            assert_eq!(out.at(x, y) & 0xff, 0, "and leaves nothing behind at {x}, {y}");
        }
    }
}

/// The square's picture and the one before it, a span earlier, over the same wall.
fn two_squares(v: (f32, f32)) -> [KeyFrame; 2] {
    let newest = square(1, 8, v);
    let was = |x: u32, y: u32| is_near(x + v.0 as u32, y + v.1 as u32, 8);
    let older = KeyFrame {
        color: ColorPlane::Rgba8(plane(WIDTH, HEIGHT, |x, y| {
            Rgba8(if was(x, y) { NEAR } else { wall(x, y) })
        })),
        depth: plane(WIDTH, HEIGHT, |x, y| if was(x, y) { 1_000_000 } else { FAR }),
        content_time: MonoTime::ZERO,
        motion_from: Some(MonoTime::ZERO),
        ..newest.clone()
    };
    let newest = KeyFrame {
        content_time: MonoTime::from_ns(1),
        motion_from: Some(MonoTime::ZERO),
        ..newest
    };
    [older, newest]
}

fn wall(x: u32, y: u32) -> u32 {
    0xff00_0000 | (hash(x, y, 3) & 0x00ff_ff00)
}

/// Pixels of the square's place in the key that do not show the wall after it has gone.
fn wrong_pixels([older, newest]: &[KeyFrame; 2]) -> usize {
    let (pool, map) = (pool(2), map_of(newest));
    let (mut out, mut scratch) = (newest.color.clone(), LinearScratch::default());
    scratch.take_key(&pool, newest);
    warp_linear(&pool, newest, &[older], &map, Phase::ONE, &mut scratch, &mut out);
    let out = words(&out);
    let places = (8..16).flat_map(|y| (24..32).map(move |x| (x, y)));
    places.filter(|(x, y)| out.at(*x, *y) != wall(*x, *y)).count()
}

#[test]
fn a_hole_shows_what_the_key_before_saw_there_where_its_depth_agrees() {
    let seen = two_squares((12.0, 0.0));
    assert_eq!(wrong_pixels(&seen), 0);
    let [older, newest] = seen;
    // Neither another depth, nor another time, nor a picture without motion.
    let nearer = KeyFrame { depth: plane(WIDTH, HEIGHT, |_, _| FAR + 100), ..older.clone() };
    let earlier = KeyFrame { content_time: MonoTime::from_ns(2), ..older.clone() };
    let first = KeyFrame { motion_from: None, ..older.clone() };
    for other in [nearer, earlier, first] {
        assert!(wrong_pixels(&[other, newest.clone()]) > 50, "a stretched wall is another");
    }
}
