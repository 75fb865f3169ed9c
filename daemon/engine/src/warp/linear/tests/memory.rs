//! The background memory: what keys before the previous one saw.

use super::*;

/// Columns of the bar.
const BAR: u32 = 20;
/// Where it begins in the newest key.
const LEFT: u32 = 36;
/// How far it goes from key to key.
const STEP: u32 = 8;

/// Keys of a bar that passes over the wall, from the newest on; in that it begins at [`LEFT`].
fn passing(count: u32) -> Vec<KeyFrame> {
    (0..count).map(|age| bar_at(LEFT - STEP * age, u64::from(10 - age))).collect()
}

/// The bar from column `left` on, over the wall, in the key at `time`.
fn bar_at(left: u32, time: u64) -> KeyFrame {
    let is_bar = |x: u32| (left..left + BAR).contains(&x);
    let color = plane(WIDTH, HEIGHT, |x, y| Rgba8(if is_bar(x) { NEAR } else { wall(x, y) }));
    let depth = plane(WIDTH, HEIGHT, |x, _| if is_bar(x) { 1_000_000 } else { FAR });
    // Dilated by one cell, as decode leaves it.
    let velocity = plane(WIDTH, HEIGHT, |x, _| {
        let moves = is_bar(x) || is_bar(x + 1) || is_bar(x.wrapping_sub(1));
        px(if moves { STEP as f32 } else { 0.0 }, 0.0)
    });
    KeyFrame {
        content_time: MonoTime::from_ns(time),
        motion_from: Some(MonoTime::from_ns(time - 1)),
        ..key(ColorPlane::Rgba8(color), depth, velocity)
    }
}

/// The frame a whole span after the first of `keys`.
fn after(keys: &[KeyFrame]) -> Plane<u32> {
    let (pool, map) = (pool(2), map_of(&keys[0]));
    let (mut out, mut scratch) = (keys[0].color.clone(), LinearScratch::default());
    scratch.take_key(&pool, &keys[0]);
    let past: Vec<_> = keys[1..].iter().collect();
    warp_linear(&pool, &keys[0], &past, &map, Phase::ONE, &mut scratch, &mut out);
    words(&out)
}

/// How many pixels that the bar has just left show the wall, of [`ALL`], and how many the bar. The
/// pixels beside an outline go with it.
fn uncovered(keys: &[KeyFrame]) -> [usize; 2] {
    let out = after(keys);
    let places = || (0..HEIGHT).flat_map(|y| (LEFT..LEFT + STEP - 1).map(move |x| (x, y)));
    let wall = places().filter(|(x, y)| out.at(*x, *y) == wall(*x, *y)).count();
    [wall, places().filter(|(x, y)| out.at(*x, *y) == NEAR).count()]
}

const ALL: usize = (7 * HEIGHT) as usize;
/// What the second key before the newest saw of that.
const PART: usize = (3 * HEIGHT) as usize;

#[test]
fn what_a_bar_hid_for_several_keys_comes_back_to_the_byte() {
    // In the key before the newest the bar hid all of it, in the one before that all but a part.
    assert_eq!([2, 3, 4, 5].map(|count| uncovered(&passing(count))[0]), [0, PART, ALL, ALL]);
}

#[test]
fn no_pixel_of_a_hole_shows_the_bar_however_far_the_memory_goes() {
    for count in 1..=5 {
        assert_eq!(uncovered(&passing(count))[1], 0, "{count} keys");
        let colors =
            [NEAR].into_iter().chain((0..WIDTH).flat_map(|x| (0..HEIGHT).map(move |y| wall(x, y))));
        let known: std::collections::BTreeSet<u32> = colors.collect();
        let out = after(&passing(count));
        assert!(out.data().iter().all(|pixel| known.contains(pixel)), "a mixture, {count} keys");
    }
}

#[test]
fn a_key_that_nothing_leads_to_is_not_shown() {
    let keys = || passing(4);
    let change = |at: usize, change: fn(&mut KeyFrame)| {
        let mut keys = keys();
        change(&mut keys[at]);
        uncovered(&keys)[0]
    };
    assert_eq!(change(2, |_| ()), ALL);
    // Its successor does not point to it, as after a cut or a lost key.
    assert_eq!(change(2, |key| key.motion_from = None), 0);
    assert_eq!(change(1, |key| key.motion_from = Some(MonoTime::ZERO)), 0);
    // It is a cut, as its picture showed: what was before it is of another place.
    assert_eq!(change(2, |key| key.is_found_cut = true), PART);
    assert_eq!(change(1, |key| key.is_found_cut = true), 0);
    // The picture had another size.
    assert_eq!(change(2, |key| key.valid.width -= 1), 0);
    // The wall was somewhere else, or went another way.
    assert_eq!(change(3, |key| key.depth = plane(WIDTH, HEIGHT, |_, _| FAR + 200)), PART);
    assert_eq!(change(1, |key| key.velocity.data_mut().fill(px(1.0, 0.0))), 0);
}

#[test]
fn a_key_that_saw_something_farther_there_ends_the_memory() {
    let mut keys = passing(4);
    // The key before the newest saw through where the bar was.
    for y in 0..HEIGHT {
        for (x, depth) in (0..).zip(keys[1].depth.row_mut(y)) {
            if (LEFT..LEFT + STEP).contains(&x) {
                *depth = FAR / 2;
            }
        }
    }
    assert_eq!(uncovered(&keys)[0], 0);
}

#[test]
fn fewer_keys_are_kept_of_fields_that_would_not_fit_a_device() {
    use crate::warp::linear::{MOST_KEYS, kept_keys};
    assert_eq!([1, 960 * 540, 1920 * 1080, 2048 * 1080].map(kept_keys), [MOST_KEYS; 4]);
    assert_eq!([3840 * 2160, 4096 * 2160, 8192 * 4320].map(kept_keys), [1, 0, 0]);
    for cells in [1, 1_000_000, 4_000_000, 5_000_000, 8_000_000, 8_847_360] {
        let kept = kept_keys(cells);
        assert!(kept == 0 || (kept + 1) * 8 * cells <= 1 << 27, "{cells}");
    }
}
