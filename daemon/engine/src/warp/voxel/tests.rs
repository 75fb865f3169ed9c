use super::*;
use crate::color::{ColorFormat, ColorPlane, Rgba8};
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::Plane;
use crate::testing::{hash, key, map_of, noise, plane, pool, px, words};
use crate::time::MonoTime;

const WIDTH: u32 = 96;
const HEIGHT: u32 = 40;

/// A key at `at_ms` whose motion points back 20 ms.
fn at(at_ms: u64, key: KeyFrame) -> KeyFrame {
    let time = |ms: u64| MonoTime::from_ns(ms * 1_000_000);
    KeyFrame { content_time: time(at_ms), motion_from: Some(time(at_ms - 20)), ..key }
}

/// The frame `phase` spans before `newer`.
fn between(threads: usize, older: &KeyFrame, newer: &KeyFrame, phase: f64) -> ColorPlane {
    let pool = pool(threads);
    let mut scratch = VoxelScratch::default();
    scratch.take_key(&pool, newer);
    let mut out = newer.color.clone();
    let frame = Between { older, newer, phase: Phase::from_f64(phase) };
    warp_voxel(&pool, &frame, &map_of(newer), &mut scratch, &mut out);
    out
}

/// A picture of noise that has moved right by `right` pixels.
fn shifted(right: u32) -> ColorPlane {
    ColorPlane::Rgba8(plane(WIDTH, HEIGHT, |x, y| Rgba8(hash(x + 1000 - right, y, 5))))
}

#[test]
fn a_picture_that_slides_is_between_its_keys_wherever_the_frame_is() {
    let moving = plane(WIDTH, HEIGHT, |_, _| px(8.0, 0.0));
    let depth = plane(WIDTH, HEIGHT, |_, _| 1000);
    let older = at(40, key(shifted(0), depth.clone(), moving.clone()));
    let newer = at(60, key(shifted(8), depth, moving));
    for (phase, right) in [(0.25, 6), (0.5, 4), (0.75, 2)] {
        let (made, expected) = (words(&between(2, &older, &newer, phase)), words(&shifted(right)));
        for y in 0..HEIGHT {
            // What comes in from the left is in no key.
            assert_eq!(made.row(y)[8..88], expected.row(y)[8..88], "{phase}, row {y}");
        }
    }
}

/// A board of 20 pixels from column `left` on, before noise that stands still.
fn board(left: u32) -> KeyFrame {
    let is_board = move |x: u32| (left..left + 20).contains(&x);
    let color =
        plane(WIDTH, HEIGHT, |x, y| Rgba8(if is_board(x) { 0xff20_40e0 } else { hash(x, y, 9) }));
    let depth = plane(WIDTH, HEIGHT, |x, _| if is_board(x) { 4000 } else { 1000 });
    let still = Velocity::default();
    // Dilated, as decode leaves it.
    let moves = move |x: u32| (left - 1..=left + 20).contains(&x);
    let velocity = plane(WIDTH, HEIGHT, |x, _| if moves(x) { px(16.0, 0.0) } else { still });
    key(ColorPlane::Rgba8(color), depth, velocity)
}

#[test]
fn what_only_one_key_shows_comes_from_that_key_alone() {
    let (older, newer) = (at(40, board(30)), at(60, board(46)));
    let made = words(&between(1, &older, &newer, 0.5));
    for y in 0..HEIGHT {
        // The pixels beside an outline go with it.
        for x in (0..WIDTH).filter(|x| ![36, 37, 58, 59].contains(x)) {
            // The board is half way, and everything else is the wall, though the newer key hides
            // some of what lies to the right of the board and the older key of what lies left.
            let is_board = (38..58).contains(&x);
            let expected = if is_board { 0xff20_40e0 } else { hash(x, y, 9) };
            assert_eq!(made.at(x, y), expected, "{x}, {y}");
        }
    }
}

#[test]
fn without_motion_the_nearer_key_counts_for_more() {
    let grey = |level: u32| {
        let color = plane(WIDTH, HEIGHT, |_, _| Rgba8(0xff00_0000 | (level * 0x01_0101)));
        let still = plane(WIDTH, HEIGHT, |_, _| Velocity::default());
        key(ColorPlane::Rgba8(color), Plane::default(), still)
    };
    let (older, newer) = (at(40, grey(0)), at(60, grey(200)));
    let level = |phase: f64| words(&between(1, &older, &newer, phase)).at(50, 20) & 0xff;
    assert_eq!([0.25, 0.5, 0.75].map(level), [150, 100, 50]);
}

#[test]
fn any_number_of_threads_makes_the_same_frame_from_any_motion() {
    for format in [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f] {
        let wild = |seed: u32| {
            let velocity = plane(31, 23, |x, y| {
                let [a, b] = [hash(x, y, seed), hash(x, y, seed + 1)];
                Velocity { x: (a % 1600) as i16 - 800, y: (b % 1600) as i16 - 800 }
            });
            let depth = plane(31, 23, |x, y| hash(x / 4, y / 4, seed) % 5000);
            key(noise(format, 53, 37, seed), depth, velocity)
        };
        let (older, newer) = (at(40, wild(3)), at(60, wild(8)));
        let one = between(1, &older, &newer, 0.3);
        assert_eq!(one, between(3, &older, &newer, 0.3), "{format:?}");
        assert_ne!(one, between(1, &older, &newer, 0.6), "{format:?}");
    }
}
