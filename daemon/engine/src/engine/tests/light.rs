//! Light that grows goes on growing in a whole stream of `auto`, on every backend, and in no other.

use super::*;
use crate::format::{DepthConvention, DepthFormat, DepthMeaning};

const SIDE: u32 = 128;
const KEYS: i64 = 14;

fn stream(method: Method) -> Engine {
    let format = StreamFormat {
        depth: Some(DepthConvention {
            format: DepthFormat::F32,
            meaning: DepthMeaning::LinearView,
        }),
        ..StreamFormat { width: SIDE, height: SIDE, ..format() }
    };
    Engine::new(format, EngineConfig::new(method, NonZeroUsize::MIN))
}

/// A still wall whose texture is lit by `percent` everywhere.
fn push_lit(engine: &mut Engine, at_ms: i64, percent: u32, is_cut: bool) {
    push(engine, at_ms, |pixel| texture(pixel, 5) * percent / 100, is_cut);
}

fn texture(pixel: u32, seed: u32) -> u32 {
    40 + crate::testing::hash(pixel, 0, seed) % 60
}

/// A still wall of so many levels per pixel.
fn push(engine: &mut Engine, at_ms: i64, level: impl Fn(u32) -> u32, is_cut: bool) {
    let color: Vec<u8> = (0..SIDE * SIDE).flat_map(|pixel| [level(pixel) as u8; 4]).collect();
    let depth: Vec<u8> = (0..SIDE * SIDE).flat_map(|_| 2.0_f32.to_le_bytes()).collect();
    let motion = vec![0; 8 * (SIDE * SIDE) as usize];
    let plane = |bytes, bytes_per_pixel| PlaneInput::packed(bytes, [SIDE, SIDE], bytes_per_pixel);
    let content_time = MonoTime::ZERO + MonoSpan::from_ms(at_ms);
    let input = KeyInput {
        index: at_ms.unsigned_abs(),
        content_time,
        motion_from: Some(content_time - MonoSpan::from_ms(25)),
        is_cut,
        color: plane(&color, 4),
        depth: Some(plane(&depth, 4)),
        motion: Some(plane(&motion, 8)),
        mask: None,
        camera: None,
        motion_from_camera: None,
    };
    engine.push_key(&input).unwrap();
}

/// Sums of the levels of some frames: at the newest key, halfway to the next one, and there.
fn brightness(engine: &mut Engine) -> [u32; 3] {
    let newest = 25 * KEYS;
    [newest, newest + 12, newest + 25]
        .map(|at_ms| frame(engine, at_ms).into_iter().map(u32::from).sum())
}

fn grow(engine: &mut Engine) {
    (1..=KEYS).for_each(|key| push_lit(engine, 25 * key, 100 + 8 * key as u32, false));
}

#[test]
fn what_grows_brighter_goes_on_by_auto_alone_and_not_across_a_cut() {
    let mut auto = stream(Method::Auto);
    grow(&mut auto);
    let [now, halfway, next] = brightness(&mut auto);
    assert!(now < halfway && halfway < next, "{now} {halfway} {next}");
    // By as much as it did from the key before: 8 of 212 %.
    let grown = f64::from(next) / f64::from(now);
    assert!((1.02..1.06).contains(&grown), "{grown}");
    // Of what has just been cut to, one step is known, which is too little to go by.
    for key in [KEYS + 1, KEYS + 2] {
        push_lit(&mut auto, 25 * key, 150 + 8 * key as u32, key == KEYS + 1);
    }
    let newest = 25 * (KEYS + 2);
    let [cut, later] = [newest, newest + 12].map(|at_ms| frame(&mut auto, at_ms));
    assert!(cut == later, "what was known before a cut goes on after it");
    let mut linear = stream(Method::Linear);
    grow(&mut linear);
    let [now, halfway, next] = brightness(&mut linear);
    assert_eq!([now, now], [halfway, next]);
}

#[test]
fn auto_that_was_chosen_while_it_ran_learns_it_anew() {
    let mut engine = stream(Method::Linear);
    grow(&mut engine);
    engine.set_method(Method::Auto, None);
    let [now, .., next] = brightness(&mut engine);
    assert_eq!(now, next);
    (1..=KEYS)
        .for_each(|key| push_lit(&mut engine, 25 * (key + KEYS), 100 + 8 * key as u32, false));
    let newest = 50 * KEYS;
    let sum = |engine: &mut Engine, at_ms| frame(engine, at_ms).into_iter().map(u32::from).sum();
    let [now, next]: [u32; 2] = [newest, newest + 25].map(|at_ms| sum(&mut engine, at_ms));
    assert!(now < next, "{now} {next}");
    engine.set_method(Method::Linear, None);
    let later: u32 = sum(&mut engine, newest + 25);
    assert_eq!(now, later);
}

#[test]
fn a_small_lamp_and_dim_light_of_a_still_scene_go_on() {
    // One lies on two rows of tiles of sixteen; the other changes the level by 2 at most.
    let lamp = |key: u32, pixel: u32| {
        let [x, y] = [pixel % SIDE, pixel / SIDE];
        let lit = x < 112 && (48..64).contains(&y);
        if lit { (60.0 * 1.05_f32.powi(key.cast_signed())) as u32 } else { 60 }
    };
    let dim = |key: u32, _: u32| 10 + 2 * key;
    let scenes: [&dyn Fn(u32, u32) -> u32; 2] = [&lamp, &dim];
    for (scene, percent) in scenes.into_iter().enumerate() {
        let mut engine = stream(Method::Auto);
        for key in 1..KEYS as u32 + 16 {
            let newest = 25 * i64::from(key);
            let level = |pixel| texture(pixel, 5) * percent(key, pixel) / 100;
            push(&mut engine, newest, level, false);
            let [now, next] = [newest, newest + 25].map(|at_ms| frame(&mut engine, at_ms));
            let is_learnt = key >= KEYS as u32;
            assert!(now != next || !is_learnt, "scene {scene}, after {key} keys");
        }
    }
}

#[test]
fn light_does_not_go_on_across_a_cut_that_nobody_declared() {
    // Light that grows by so much that another texture looks like more of it.
    let push_of = |engine: &mut Engine, key: i64, seed: u32| {
        let lit = 0.2 * 1.2_f32.powi(key as i32);
        push(engine, 25 * key, |pixel| (texture(pixel, seed) as f32 * lit) as u32, false);
        [25 * key, 25 * key + 12].map(|at_ms| frame(engine, at_ms))
    };
    for (seed, goes_on) in [(5, true), (6, false)] {
        let mut engine = stream(Method::Auto);
        for key in 1..12 {
            push_of(&mut engine, key, 5);
        }
        let [now, later] = push_of(&mut engine, 12, seed);
        assert_eq!(now != later, goes_on, "texture {seed}");
    }
}

#[cfg(feature = "gpu")]
#[test]
fn every_adapter_goes_on_with_it_as_the_cpu_does() {
    use crate::backend::gpu::test_adapters::test_gpus;
    let mut on_cpu = stream(Method::Auto);
    grow(&mut on_cpu);
    let at_ms = 25 * KEYS + 9;
    let expected = frame(&mut on_cpu, at_ms);
    let is_lit = expected != frame(&mut on_cpu, 25 * KEYS);
    assert!(is_lit, "there is something to compare");
    for gpu in test_gpus("every_adapter_goes_on_with_it_as_the_cpu_does") {
        let mut on_gpu = stream(Method::Auto);
        on_gpu.use_gpu(&gpu);
        grow(&mut on_gpu);
        assert!(frame(&mut on_gpu, at_ms) == expected, "{}", gpu.name());
        // The device is lost between two pictures of one key.
        gpu.lose();
        assert!(frame(&mut on_gpu, at_ms) == expected, "after {} was lost", gpu.name());
    }
}
