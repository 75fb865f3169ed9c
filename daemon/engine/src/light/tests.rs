//! Light that goes on is continued, and what is no such light is left alone.

use super::relight::relight;
use super::*;
use crate::color::{ColorPlane, OrderedRgba16, Rgba8, Texel, half_to_ordered};
use crate::plane::Rect;
use crate::testing::{hash, key as key_of, map_of, plane, pool, px};
use crate::time::MonoTime;

const SIZE: [u32; 2] = [160, 96];
/// Pixels per key that everything moves to the right.
const PAN: u32 = 3;

/// Grey texture that moves by [`PAN`], in the light that `lit` gives a pixel, 1 by itself.
fn shown(index: u32, lit: impl Fn(f32, f32) -> f32) -> ColorPlane {
    ColorPlane::Rgba8(plane(SIZE[0], SIZE[1], |x, y| {
        let texture = 60 + hash((x + 400 - PAN * index) / 4, y / 4, 7) % 60;
        let level = (texture as f32 * lit(x as f32, y as f32)).round().clamp(0.0, 255.0);
        Rgba8(0xff00_0000 | (0x01_01_01 * level as u32))
    }))
}

/// The `index`-th key.
fn key(index: u32, lit: impl Fn(f32, f32) -> f32) -> KeyFrame {
    let depth = plane(SIZE[0], SIZE[1], |_, _| 1 << 20);
    let velocity = plane(SIZE[0], SIZE[1], |_, _| px(PAN as f32, 0.0));
    let time = |index: u32| MonoTime::from_ns(1_000_000_000 + 25_000_000 * u64::from(index));
    KeyFrame {
        content_time: time(index),
        motion_from: Some(time(index.saturating_sub(1))),
        ..key_of(shown(index, lit), depth, velocity)
    }
}

/// What is known after `keys`, of which flow explains nothing.
fn after(keys: &[KeyFrame]) -> Light {
    let mut light = Light::new(keys[0].color.format());
    for pair in keys.windows(2) {
        light.take_key(&pool(2), &pair[1], &pair[0], &map_of(&pair[1]), |_| false);
    }
    light
}

/// Mean square of the difference of two pictures, in levels, away from what comes into sight.
fn error(a: &ColorPlane, b: &ColorPlane) -> f64 {
    let (ColorPlane::Rgba8(a), ColorPlane::Rgba8(b)) = (a, b) else { panic!("both are rgba8") };
    let mut sum = 0.0;
    for y in 0..SIZE[1] {
        for x in 8..SIZE[0] {
            sum += f64::from(a.at(x, y).luma8().abs_diff(b.at(x, y).luma8())).powi(2);
        }
    }
    sum / f64::from((SIZE[0] - 8) * SIZE[1])
}

/// How far the picture a key interval after `keys` is off, as it would be made without change of
/// light, and with it. `lit` is the light of the key to come.
fn errors(keys: &[KeyFrame], lit: impl Fn(f32, f32) -> f32) -> [f64; 2] {
    let next = keys.len() as u32;
    let truth = shown(next, lit);
    let newest = &keys[keys.len() - 1];
    // The warp, of a texture that moves by whole pixels.
    let ColorPlane::Rgba8(from) = &newest.color else { panic!("rgba8") };
    let moved = |x: u32, y: u32| from.at(x.saturating_sub(PAN), y);
    let mut made = ColorPlane::Rgba8(plane(SIZE[0], SIZE[1], moved));
    let before = error(&made, &truth);
    let mut light = after(keys);
    if let Some(gains) = light.gains(&pool(2), Phase::ONE) {
        relight(&pool(2), gains, newest.valid, &mut made);
    }
    [before, error(&made, &truth)]
}

/// Keys enough for every row of tiles to have had its turn, each in the light that `lit` says.
fn keys(lit: impl Fn(u32, f32, f32) -> f32) -> Vec<KeyFrame> {
    let lit = &lit;
    (0..TURNS + 4).map(|index| key(index, move |x, y| lit(index, x, y))).collect()
}

#[test]
fn a_lamp_that_grows_brighter_goes_on_and_one_that_flickers_does_not() {
    // A pool of light.
    let near = |x: f32| (1.0 - x / 200.0).max(0.0);
    let grows = |index: u32, x: f32, _: f32| 1.0 + 0.09 * index as f32 * near(x);
    let next = TURNS + 4;
    let [before, now] = errors(&keys(grows), |x, y| grows(next, x, y));
    assert!(now < 0.25 * before, "{before} to {now}");
    let flickers = |index: u32, x: f32, _: f32| 1.0 + 0.5 * (index % 2) as f32 * near(x);
    assert!(after(&keys(flickers)).gains(&pool(2), Phase::ONE).is_none());
}

#[test]
fn a_shadow_moves_on_and_one_that_has_just_fallen_does_not() {
    // Its edge moves by a tile per key against the texture.
    let edge = |index: u32, x: f32| x < ((PAN + TILE) * index) as f32;
    let passes = |index: u32, x: f32, _: f32| if edge(index, x) { 0.6 } else { 1.0 };
    let [before, now] = errors(&keys(passes), |x, y| passes(TURNS + 4, x, y));
    assert!(now < 0.6 * before, "{before} to {now}");
    let falls = |index: u32, x: f32, _: f32| if index > TURNS + 2 && x < 80.0 { 0.6 } else { 1.0 };
    assert!(after(&keys(falls)).gains(&pool(2), Phase::ONE).is_none());
}

#[test]
fn what_comes_in_front_is_no_light_and_neither_is_what_flow_explains() {
    let grows = |index: u32, _: f32, _: f32| 1.0 + 0.09 * index as f32;
    let sound = keys(grows);
    assert!(after(&sound).gains(&pool(2), Phase::ONE).is_some());
    // The same pictures, each of a surface that is not the one before.
    let mut others = sound.clone();
    for (index, key) in (0..).zip(&mut others) {
        key.depth = plane(SIZE[0], SIZE[1], |_, _| if index % 2 == 0 { 1 << 20 } else { 1 << 22 });
    }
    assert!(after(&others).gains(&pool(2), Phase::ONE).is_none());
    let mut light = Light::new(ColorFormat::Rgba8);
    for pair in sound.windows(2) {
        light.take_key(&pool(2), &pair[1], &pair[0], &map_of(&pair[1]), |_| true);
    }
    assert!(light.gains(&pool(2), Phase::ONE).is_none());
}

#[test]
fn what_is_not_shown_to_go_as_it_came_has_no_light_of_its_own() {
    let grows = |index: u32, _: f32, _: f32| 1.0 + 0.09 * index as f32;
    let mut held = keys(grows);
    for key in &mut held {
        key.came = key.velocity.clone();
        key.velocity = plane(SIZE[0], SIZE[1], |_, _| Velocity::default());
    }
    assert!(after(&held).gains(&pool(2), Phase::ONE).is_none());
    // Held across alone.
    for key in &mut held {
        key.velocity = plane(SIZE[0], SIZE[1], |_, _| Velocity { x: 0, y: 16 });
    }
    assert!(after(&held).gains(&pool(2), Phase::ONE).is_none());
    let mut damped = keys(grows);
    for key in &mut damped {
        key.displacement = plane(SIZE[0], SIZE[1], |_, _| [PAN as f32 + 1.5, 0.0]);
    }
    assert!(after(&damped).gains(&pool(2), Phase::ONE).is_none());
    for key in &mut damped {
        key.displacement = plane(SIZE[0], SIZE[1], |_, _| [PAN as f32, 0.0]);
    }
    assert!(after(&damped).gains(&pool(2), Phase::ONE).is_some());
}

#[test]
fn light_runs_into_rows_that_nobody_has_looked_at() {
    // Six rows of tiles grow brighter while all moves down by five.
    const DOWN: u32 = 5 * TILE;
    let size = [64, 640];
    let key = |index: u32| {
        let lit = |y: u32| (DOWN * index..DOWN * index + 6 * TILE).contains(&y);
        let level = |x: u32, y: u32| {
            let texture = 60 + hash(x / 4, (y + 1000 - DOWN * index) / 4, 7) % 60;
            (texture as f32 * if lit(y) { 1.0 + 0.09 * index as f32 } else { 1.0 }) as u32
        };
        let color = plane(size[0], size[1], |x, y| Rgba8(0xff00_0000 | (0x01_01_01 * level(x, y))));
        let depth = plane(size[0], size[1], |_, _| 1 << 20);
        let velocity = plane(size[0], size[1], |_, _| px(0.0, DOWN as f32));
        let time = |index: u32| MonoTime::from_ns(1_000_000_000 + 25_000_000 * u64::from(index));
        KeyFrame {
            content_time: time(index),
            motion_from: Some(time(index.saturating_sub(1))),
            ..key_of(ColorPlane::Rgba8(color), depth, velocity)
        }
    };
    let keys: Vec<KeyFrame> = (0..TURNS + 4).map(key).collect();
    let mut light = after(&keys);
    let gains = light.gains(&pool(2), Phase::ONE).unwrap();
    let first = 5 * keys.len() as u32;
    let grown = |row: u32| gains.at(gains.width() / 2, row) > 4096;
    // Those at the edges are judged with others that do not change.
    let lit: Vec<u32> = (0..gains.height()).filter(|row| grown(*row)).collect();
    assert!((first + 1..first + 5).all(grown), "lit {lit:?}, from {first} on");
    assert!(!grown(first - 2) && !grown(first + 8), "lit {lit:?}, from {first} on");
}

#[test]
fn noise_in_the_dark_of_half_floats_is_no_change_of_light() {
    let noisy = |index: u32, least: u16, most: u16| {
        let code = |x: u32, y: u32| if hash(x, y, index).is_multiple_of(2) { least } else { most };
        let texel = |x: u32, y: u32| OrderedRgba16([code(x, y); 4].map(half_to_ordered));
        let color = ColorPlane::Rgba16f(plane(SIZE[0], SIZE[1], texel));
        KeyFrame { color, ..key(index, |_, _| 1.0) }
    };
    let changes = |least: u16, most: u16| {
        let [then, now] = [0, 1].map(|index| noisy(index, least, most));
        let map = map_of(&now);
        let comparison = Comparison::new(&now, &then, &map).unwrap();
        let mut changes = Plane::default();
        changes.resize(SIZE[0] / TILE, SIZE[1] / TILE);
        measure(&pool(2), &comparison, &[true; (SIZE[1] / TILE) as usize], &mut changes);
        changes.data().iter().filter(|change| change.octaves != 0.0).count()
    };
    // 0 and 0.0005; then a quarter and a half.
    assert_eq!(changes(0, 0x1019), 0);
    assert!(changes(0x3400, 0x3800) > 50, "there is something to see");
}

#[test]
fn light_goes_on_by_time_and_not_by_keys() {
    // A third of an octave per 100 ms, whatever the time between keys.
    let between = [25, 25, 25, 25, 25, 25, 25, 25, 25, 25, 50, 25];
    let mut at_ms = 0_u16;
    let mut keys: Vec<KeyFrame> = Vec::new();
    for (index, span) in (0..).zip(between) {
        at_ms += span;
        let level = 2.0_f32.powf(f32::from(at_ms) / 300.0);
        let content_time = MonoTime::from_ns(1_000_000_000 + 1_000_000 * u64::from(at_ms));
        let motion_from = keys.last().map(|key| key.content_time);
        keys.push(KeyFrame { content_time, motion_from, ..key(index, |_, _| level) });
    }
    for count in [between.len() - 1, between.len()] {
        let span = between[count - 1];
        let mut light = after(&keys[..count]);
        let gains = light.gains(&pool(2), Phase::ONE).unwrap();
        let middle = gains.at(gains.width() / 2, gains.height() / 2) as f32 / 4096.0;
        let expected = 2.0_f32.powf(f32::from(span) / 300.0);
        assert!((middle / expected - 1.0).abs() < 0.02, "{span} ms: {middle} for {expected}");
    }
}

#[test]
fn nothing_changes_at_the_key_nor_in_steady_light_nor_after_a_cut() {
    let grows = |index: u32, _: f32, _: f32| 1.0 + 0.09 * index as f32;
    let mut light = after(&keys(grows));
    assert!(light.gains(&pool(2), Phase::ZERO).is_none());
    let most = light.gains(&pool(2), Phase::ONE).unwrap().clone();
    assert!(most.data().iter().all(|gain| *gain > 4096));
    let largest = |gains: &Plane<i32>| gains.data().iter().max().copied();
    let later = largest(light.gains(&pool(2), Phase::MAX).unwrap());
    assert_eq!(later, largest(&most), "no further than one key interval");
    let half = light.gains(&pool(2), Phase::from_f64(0.5)).unwrap();
    assert!(half.data().iter().zip(most.data()).all(|(half, most)| half < most && *half > 4096));
    light.forget();
    assert!(light.gains(&pool(2), Phase::ONE).is_none());
    assert!(after(&keys(|_, _, _| 1.0)).gains(&pool(2), Phase::ONE).is_none());
}

#[test]
fn any_number_of_threads_sees_the_same() {
    let grows = |index: u32, x: f32, y: f32| 1.0 + 0.001 * index as f32 * (x + y);
    let keys = keys(grows);
    let with = |threads: usize| {
        let mut light = Light::new(ColorFormat::Rgba8);
        for pair in keys.windows(2) {
            light.take_key(&pool(threads), &pair[1], &pair[0], &map_of(&pair[1]), |_| false);
        }
        light.gains(&pool(2), Phase::from_f64(0.7)).unwrap().clone()
    };
    assert_eq!(with(1), with(5));
}

#[test]
fn a_picture_that_is_smaller_than_a_tile_or_has_another_shape_is_left_alone() {
    let small = Rect { x: 1, y: 2, width: 3, height: 5 };
    let grows = |index: u32, _: f32, _: f32| 1.0 + 0.09 * index as f32;
    let mut keys = keys(grows);
    for key in &mut keys {
        key.valid = small;
    }
    assert!(after(&keys).gains(&pool(2), Phase::ONE).is_none());
    keys[5].valid.width = 2;
    after(&keys);
}
