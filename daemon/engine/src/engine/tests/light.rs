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

/// A still wall whose texture is lit by `percent`.
fn push_lit(engine: &mut Engine, at_ms: i64, percent: u32, is_cut: bool) {
    let level = |pixel: u32| (40 + crate::testing::hash(pixel, 0, 5) % 60) * percent / 100;
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
    push_lit(&mut auto, 25 * KEYS + 1, 250, true);
    let [cut, .., later] = brightness(&mut auto);
    assert_eq!(cut, later, "nothing is known after a cut");
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
