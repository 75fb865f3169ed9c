//! Every adapter of the machine makes the bytes that the CPU makes.

use super::test_adapters::test_gpus;
use super::*;
use crate::backend::cpu::CpuBackend;
use crate::key::{Acceleration, Velocity};
use crate::light::TILE;
use crate::light::relight;
use crate::plane::{Plane, Rect};
use crate::testing::{hash, map_of, noise, plane, pool};
use crate::time::MonoTime;

mod between;

const FORMATS: [ColorFormat; 3] = [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f];
const WARPS: [Method; 3] = [Method::Gather, Method::Grid, Method::Linear];

/// A velocity of noise, up to `reach` pixels per axis; one in 64 is not trackable.
fn velocity_noise(width: u32, height: u32, reach: i32, seed: u32) -> Plane<Velocity> {
    plane(width, height, |x, y| {
        // Patches of one motion, as surfaces are, among single cells.
        let (px, py) = if seed.is_multiple_of(2) { (x / 5, y / 4) } else { (x, y) };
        let steps = |salt: u32| {
            let span = (64 * reach + 1).cast_unsigned();
            ((hash(px, py, seed ^ salt) % span).cast_signed() - 32 * reach) as i16
        };
        if hash(x, y, seed ^ 7).is_multiple_of(64) {
            Velocity::UNTRACKABLE
        } else {
            Velocity { x: steps(1), y: steps(2) }
        }
    })
}

/// Depth keys of noise with many ties.
fn depth_noise(width: u32, height: u32, seed: u32) -> Plane<u32> {
    plane(width, height, |x, y| match hash(x / 3, y / 3, seed) % 4 {
        0 => u32::MAX,
        1 => 1 << 20,
        2 => (1 << 20) + hash(x, y, seed) % (1 << 13),
        _ => hash(x, y, seed ^ 1),
    })
}

/// A key that moves, as decode leaves it: with a time that its motion points back to.
fn key(color: ColorPlane, depth: Plane<u32>, velocity: Plane<Velocity>) -> KeyFrame {
    let key = crate::testing::key(color, depth, velocity);
    let content_time = MonoTime::from_ns(1);
    KeyFrame { content_time, motion_from: Some(MonoTime::ZERO), ..key }
}

fn phases() -> impl Iterator<Item = Phase> {
    [1.0 / 4096.0, 0.37, 1.0, 2.5, 4.0].into_iter().map(Phase::from_f64)
}

fn on_cpu(method: Method, keys: &[&KeyFrame], phase: Phase) -> ColorPlane {
    let (newest, past) = newest_and_past(keys);
    let pool = pool(1);
    let map = map_of_moving(newest);
    let mut cpu = CpuBackend::default();
    cpu.take_key(&pool, method, newest);
    let mut out = newest.color.clone();
    cpu.make(&pool, &input(method, phase, &past, newest, &map), &mut out);
    out
}

fn on_gpu(
    gpu: &Arc<Gpu>,
    method: Method,
    keys: &[&KeyFrame],
    phases: impl Iterator<Item = Phase>,
) -> Vec<ColorPlane> {
    let (newest, past) = newest_and_past(keys);
    let mut backend =
        GpuBackend::new(gpu, newest.color.format(), method, Passes::default()).unwrap();
    for key in keys {
        backend.take_key(key, &map_of_moving(key)).unwrap();
    }
    let map = map_of_moving(newest);
    let make = |phase| {
        let mut out = newest.color.clone();
        backend.make(&input(method, phase, &past, newest, &map), &mut out, false).unwrap();
        out
    };
    phases.map(make).collect()
}

fn map_of_moving(key: &KeyFrame) -> FieldMap {
    if key.velocity.data().is_empty() { FieldMap::default() } else { map_of(key) }
}

fn input<'a>(
    method: Method,
    phase: Phase,
    past: &'a [&'a KeyFrame],
    newest: &'a KeyFrame,
    map: &'a FieldMap,
) -> FrameInput<'a> {
    FrameInput { method, phase, newest, past, map, gains: None, finish: None }
}

/// The last of `keys`, and the others from the newest on.
fn newest_and_past<'a>(keys: &[&'a KeyFrame]) -> (&'a KeyFrame, Vec<&'a KeyFrame>) {
    (keys[keys.len() - 1], keys[..keys.len() - 1].iter().rev().copied().collect())
}

/// The first byte in which two pictures differ.
fn difference(a: &ColorPlane, b: &ColorPlane) -> Option<usize> {
    a.as_bytes().iter().zip(b.as_bytes()).position(|(a, b)| a != b)
}

fn assert_same(gpu: &Arc<Gpu>, method: Method, key: &KeyFrame, what: &str) {
    for (phase, picture) in phases().zip(on_gpu(gpu, method, &[key], phases())) {
        let expected = on_cpu(method, &[key], phase);
        assert_eq!(
            difference(&picture, &expected),
            None,
            "{what}: {method} of {:?} at phase {} on {}",
            key.color.format(),
            phase.as_f64(),
            gpu.name()
        );
    }
}

#[test]
fn every_adapter_fills_holes_from_the_keys_before_as_the_cpu_does() {
    let cases = [([64, 40], [64, 40], 6), ([213, 120], [142, 80], 20), ([213, 120], [54, 30], 40)];
    for gpu in test_gpus("every_adapter_fills_holes_from_the_keys_before_as_the_cpu_does") {
        let cases = cases.into_iter().flat_map(|case| FORMATS.map(|format| (case, format)));
        for (seed, ((size, cells, reach), format)) in (0..).zip(cases) {
            // One place, before which something nearer comes and goes; it hardly moves.
            let came = |age: u32| {
                let step = |x: u32, salt: u32| (hash(x / 9, salt, age) % 5) as i16 - 2;
                plane(cells[0], cells[1], |x, y| Velocity { x: step(x, 1), y: step(y, 2) })
            };
            let place = depth_noise(cells[0], cells[1], 3);
            let of = |age: u32| {
                let is_hidden = |x: u32, y: u32| hash(x / 6, y / 6, age).is_multiple_of(3);
                let depth = plane(cells[0], cells[1], |x, y| {
                    if is_hidden(x, y) { u32::MAX - 1 } else { place.at(x, y) }
                });
                let velocity = velocity_noise(cells[0], cells[1], reach, seed + age);
                let time = |age: u32| MonoTime::from_ns(100 - u64::from(age));
                KeyFrame {
                    content_time: time(age),
                    motion_from: Some(time(age + 1)),
                    came: came(age),
                    ..key(noise(format, size[0], size[1], seed + age), depth, velocity)
                }
            };
            let keys = [7, 6, 5, 4, 3, 2, 1, 0].map(of);
            let all: Vec<_> = keys.iter().collect();
            let mut differs = [false; 2];
            for (phase, picture) in phases().zip(on_gpu(&gpu, Method::Linear, &all, phases())) {
                let expected = on_cpu(Method::Linear, &all, phase);
                let found = difference(&picture, &expected);
                assert_eq!(found, None, "{size:?} over {cells:?}, {format:?}");
                for (differs, kept) in differs.iter_mut().zip([0, 1]) {
                    let fewer = on_cpu(Method::Linear, &all[7 - kept..], phase);
                    *differs |= difference(&expected, &fewer).is_some();
                }
            }
            assert_eq!(differs, [true; 2], "the keys before make a difference");
        }
    }
}

#[test]
fn every_adapter_warps_noise_as_the_cpu_does() {
    // Size of the picture, of the field, speed in pixels.
    let cases = [
        ([17, 9], [17, 9], 3),
        ([17, 9], [9, 5], 12),
        ([64, 40], [64, 40], 6),
        ([213, 120], [142, 80], 20),
        ([333, 77], [84, 20], 1023),
        ([3, 1], [1, 1], 2),
    ];
    for gpu in test_gpus("every_adapter_warps_noise_as_the_cpu_does") {
        for (seed, (size, cells, reach)) in (0..).zip(cases) {
            for (format, method) in FORMATS.iter().flat_map(|f| WARPS.map(|m| (*f, m))) {
                let key = key(
                    noise(format, size[0], size[1], seed),
                    depth_noise(cells[0], cells[1], seed),
                    velocity_noise(cells[0], cells[1], reach, seed),
                );
                assert_same(&gpu, method, &key, &format!("{size:?} over {cells:?}"));
            }
        }
    }
}

#[test]
fn every_adapter_minds_valid_rectangles_and_jitter() {
    for gpu in test_gpus("every_adapter_minds_valid_rectangles_and_jitter") {
        for (seed, method) in (0..).zip(WARPS) {
            let mut key = key(
                noise(ColorFormat::Rgba8, 101, 67, seed),
                depth_noise(43, 31, seed),
                velocity_noise(43, 31, 9, seed),
            );
            key.valid = Rect { x: 5, y: 11, width: 83, height: 47 };
            key.field_offset = [97, -211];
            assert_same(&gpu, method, &key, "letterbox and jitter");
        }
    }
}

#[test]
fn every_adapter_warps_without_depth() {
    for gpu in test_gpus("every_adapter_warps_without_depth") {
        for seed in 0..2 {
            let color = noise(ColorFormat::Rgba8, 80, 60, seed);
            let key = key(color, Plane::default(), velocity_noise(40, 30, 15, seed));
            assert_same(&gpu, Method::Linear, &key, "no depth");
            assert_same(&gpu, Method::Grid, &key, "no depth");
        }
    }
}

#[test]
fn every_adapter_accelerates_as_the_cpu_does_and_forgets_it_with_the_next_key() {
    let name = "every_adapter_accelerates_as_the_cpu_does_and_forgets_it_with_the_next_key";
    for gpu in test_gpus(name) {
        for (seed, reach) in [(0, 12), (1, 300), (2, 0)] {
            let steady = key(
                noise(ColorFormat::Rgba8, 90, 70, seed),
                depth_noise(45, 35, seed),
                velocity_noise(45, 35, reach, seed),
            );
            let acceleration = velocity_noise(45, 35, 2 * reach + 3, seed + 8);
            let moves = |v: Velocity| if v.is_trackable() { v } else { Velocity::default() };
            let acceleration = plane(45, 35, |x, y| {
                let Velocity { x, y } = moves(acceleration.at(x, y));
                Acceleration { x, y }
            });
            let accelerating = KeyFrame { acceleration, ..steady.clone() };
            assert_same(&gpu, Method::Linear, &accelerating, "acceleration");
            let phase = Phase::from_f64(0.7);
            let expected = on_cpu(Method::Linear, &[&steady], phase);
            let keys = [&accelerating, &steady, &accelerating, &steady];
            let found = on_gpu(&gpu, Method::Linear, &keys, [phase].into_iter());
            assert_eq!(difference(&found[0], &expected), None, "steady again on {}", gpu.name());
            let bent = on_cpu(Method::Linear, &[&accelerating], phase);
            assert!(difference(&bent, &expected).is_some(), "acceleration changes the picture");
        }
    }
}

#[test]
fn every_adapter_fills_a_picture_that_moved_out_altogether() {
    for gpu in test_gpus("every_adapter_fills_a_picture_that_moved_out_altogether") {
        for velocity in [[1023, 0], [0, -1023], [200, 200]] {
            let velocity =
                plane(64, 48, |_, _| Velocity { x: velocity[0] * 32, y: velocity[1] * 32 });
            let key = key(noise(ColorFormat::Rgba8, 128, 96, 5), depth_noise(64, 48, 3), velocity);
            for method in WARPS {
                assert_same(&gpu, method, &key, "gone");
            }
        }
    }
}

#[test]
fn every_adapter_warps_a_picture_8192_pixels_wide() {
    for gpu in test_gpus("every_adapter_warps_a_picture_8192_pixels_wide") {
        let key = key(
            noise(ColorFormat::Rgba8, 8192, 6, 1),
            depth_noise(8192, 6, 1),
            velocity_noise(8192, 6, 40, 2),
        );
        for method in WARPS {
            assert_same(&gpu, method, &key, "8192 wide");
        }
    }
}

/// Planes of up to 8 bytes a pixel, each in one binding: lavapipe binds 128 MiB.
#[test]
fn every_adapter_warps_a_picture_of_4096x2160() {
    for gpu in test_gpus("every_adapter_warps_a_picture_of_4096x2160") {
        // Few edges: a device has to answer in time.
        let patch = |x, y| hash(x / 128, y / 120, 1);
        let depth = plane(2048, 1080, patch);
        let velocity = plane(2048, 1080, |x, y| {
            let steps = patch(x, y);
            Velocity { x: (steps % 999) as i16 - 500, y: (steps >> 16) as i16 % 500 }
        });
        let key = key(noise(ColorFormat::Rgba16f, 4096, 2160, 4), depth, velocity);
        let phase = Phase::from_f64(0.37);
        let made = on_gpu(&gpu, Method::Linear, &[&key], std::iter::once(phase));
        let expected = on_cpu(Method::Linear, &[&key], phase);
        assert_eq!(difference(&made[0], &expected), None, "on {}", gpu.name());
        assert_ne!(difference(&key.color, &expected), None, "something moved");
    }
}

#[test]
fn every_adapter_blends_as_the_cpu_does() {
    for gpu in test_gpus("every_adapter_blends_as_the_cpu_does") {
        for format in FORMATS {
            let keys = [1, 2, 3]
                .map(|seed| key(noise(format, 53, 19, seed), Plane::default(), Plane::default()));
            let [_, older, newer] = &keys;
            let made = on_gpu(
                &gpu,
                Method::Blend,
                &[&keys[0], older, newer],
                std::iter::once(Phase::ZERO),
            );
            let expected = on_cpu(Method::Blend, &[older, newer], Phase::ZERO);
            assert_eq!(difference(&made[0], &expected), None, "{format:?} on {}", gpu.name());
        }
    }
}

/// The bytes of a picture that stayed on its device.
fn read(picture: &GpuPicture, like: &ColorPlane) -> ColorPlane {
    let (gpu, mut out) = (picture.gpu(), like.clone());
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    let mut download = Download::default();
    let size = out.as_bytes().len() as u64;
    download.copy(gpu, &mut commands, picture.buffer(), size);
    let submission = gpu.queue.submit([commands.finish()]);
    download.read(gpu, submission, out.as_mut_bytes()).unwrap();
    out
}

#[test]
fn a_picture_that_stays_on_its_device_is_the_one_that_would_come_back_whatever_follows() {
    for gpu in test_gpus("a_picture_that_stays_on_its_device_is_the_one_that_would_come_back") {
        let newest =
            key(noise(FORMATS[0], 64, 40, 1), depth_noise(64, 40, 2), velocity_noise(64, 40, 6, 3));
        let map = map_of(&newest);
        let mut backend =
            GpuBackend::new(&gpu, newest.color.format(), Method::Linear, Passes::default())
                .unwrap();
        backend.take_key(&newest, &map).unwrap();
        let mut out = newest.color.clone();
        let mut make = |phase, keeps| {
            let input = input(Method::Linear, phase, &[], &newest, &map);
            backend.make(&input, &mut out, keeps).unwrap()
        };
        let phases: Vec<_> = phases().collect();
        // Two at a time, and others in between.
        for pair in phases.windows(2) {
            let kept = [0, 1].map(|it| make(pair[it], true).expect("it stays"));
            assert!(make(Phase::from_f64(0.5), false).is_none(), "it comes back");
            let size = [newest.color.width(), newest.color.height()];
            let expected = [0, 1].map(|it| on_cpu(Method::Linear, &[&newest], pair[it]));
            for (kept, expected) in kept.iter().zip(&expected) {
                assert_eq!(kept.size(), size);
                assert_eq!(difference(&read(kept, expected), expected), None, "{}", gpu.name());
            }
            // The control: they are two pictures.
            assert_ne!(difference(&read(&kept[0], &expected[0]), &expected[1]), None);
        }
    }
}

#[test]
fn one_pixel_of_the_key_that_differs_is_found() {
    for gpu in test_gpus("one_pixel_of_the_key_that_differs_is_found") {
        for method in WARPS {
            let still = plane(16, 16, |_, _| Velocity { x: 16, y: 0 });
            let key = key(noise(ColorFormat::Rgba8, 16, 16, 9), Plane::default(), still);
            let mut other = key.clone();
            other.color.as_mut_bytes()[4 * (16 * 7 + 7)] ^= 8;
            let made = on_gpu(&gpu, method, &[&other], std::iter::once(Phase::ONE));
            let expected = on_cpu(method, &[&key], Phase::ONE);
            assert_ne!(difference(&made[0], &expected), None, "{method} on {}", gpu.name());
        }
    }
}

#[test]
fn a_plane_that_no_binding_holds_is_refused_with_both_numbers() {
    for gpu in test_gpus("a_plane_that_no_binding_holds_is_refused_with_both_numbers") {
        let limit = gpu.device.limits().max_storage_buffer_binding_size;
        let error = Planes::default().sized(&gpu, Slot::Color, limit + 4).unwrap_err();
        assert_eq!(error, GpuError::TooLarge { needed: limit + 4, limit });
        let of_4096x2160_halves = 4096 * 2160 * 8;
        assert!(limit >= of_4096x2160_halves, "{} binds only {limit}", gpu.name());
    }
}

#[test]
fn a_shader_that_does_not_compile_is_an_error_and_the_device_goes_on() {
    for gpu in test_gpus("a_shader_that_does_not_compile_is_an_error_and_the_device_goes_on") {
        let wrong_texts = [
            "no shader at all",
            "@compute @workgroup_size(16, 16) fn blend() { undeclared(); }",
            "@compute @workgroup_size(16, 16) fn another_name() {}",
        ];
        for text in wrong_texts {
            let error = gpu.compile(&BLEND, text, ColorFormat::Rgba8).unwrap_err();
            assert!(matches!(error, GpuError::Refused { .. }), "{text}: {error}");
        }
        assert!(!gpu.is_lost());
        GpuBackend::new(&gpu, ColorFormat::Rgba8, Method::Blend, Passes::default()).unwrap();
    }
}

#[test]
fn a_step_before_its_key_is_an_error() {
    for gpu in test_gpus("a_step_before_its_key_is_an_error") {
        let key = key(noise(ColorFormat::Rgba8, 4, 4, 1), Plane::default(), Plane::default());
        let mut backend =
            GpuBackend::new(&gpu, ColorFormat::Rgba8, Method::Blend, Passes::default()).unwrap();
        let mut out = key.color.clone();
        let map = FieldMap::default();
        let made =
            backend.make(&input(Method::Blend, Phase::ZERO, &[&key], &key, &map), &mut out, false);
        assert!(matches!(made, Err(GpuError::Refused { .. })), "{made:?}");
    }
}

#[test]
fn every_adapter_finishes_as_the_cpu_does() {
    use crate::finish::{Finish, FinishConfig, FinishMode, Part};
    use crate::format::StreamFormat;
    use crate::time::MonoSpan;
    let parts = [
        Part::Key { frames: 3 },
        Part::InBetween { frames: 3 },
        Part::InBetween { frames: 2 },
        Part::Key { frames: 7 },
    ];
    let cases = [([1, 1], None), ([17, 9], None), ([203, 77], Some([3, 5, 190, 66]))];
    for gpu in test_gpus("every_adapter_finishes_as_the_cpu_does") {
        for (seed, (size, valid)) in (0..).zip(cases) {
            for (format, mode, is_whole) in FORMATS
                .into_iter()
                .flat_map(|format| [(format, FinishMode::On), (format, FinishMode::Auto)])
                .flat_map(|(format, mode)| [(format, mode, true), (format, mode, false)])
            {
                let stream =
                    StreamFormat { color: format, ..StreamFormat::rgba8(size[0], size[1]) };
                let config = FinishConfig {
                    mode,
                    is_whole,
                    gamma: Some([2.2, 2.0, 1.8]),
                    refresh_interval: MonoSpan::from_hz(120.0),
                    ..FinishConfig::default()
                };
                let mut finish = Finish::new(&stream, &config, Some(56.0)).unwrap();
                let mut key = key(
                    noise(format, size[0], size[1], seed),
                    Plane::default(),
                    velocity_noise(size[0], size[1], 3, seed),
                );
                if let Some([x, y, width, height]) = valid {
                    key.valid = Rect { x, y, width, height };
                }
                let map = map_of(&key);
                let mut backend = GpuBackend::new(
                    &gpu,
                    format,
                    Method::Gather,
                    Passes { finishes: true, ..Passes::default() },
                )
                .unwrap();
                backend.take_key(&key, &map).unwrap();
                let phase = Phase::from_f64(0.37);
                finish.take_key(&pool(1), &key, None, &map, None);
                finish.turn_to(phase, 0);
                for part in parts {
                    let mut expected = on_cpu(Method::Gather, &[&key], phase);
                    finish.apply(&pool(1), part, key.valid, &mut expected);
                    let split = finish.split(part);
                    let frame = FrameInput {
                        finish: split,
                        ..input(Method::Gather, phase, &[], &key, &map)
                    };
                    let mut made = key.color.clone();
                    backend.make(&frame, &mut made, false).unwrap();
                    assert_eq!(
                        difference(&made, &expected),
                        None,
                        "{part:?} of {format:?} {size:?} {mode} on {}",
                        gpu.name()
                    );
                }
                let plain = on_cpu(Method::Gather, &[&key], phase);
                let mut finished = plain.clone();
                finish.apply(&pool(1), parts[0], key.valid, &mut finished);
                let is_changed = difference(&plain, &finished).is_some();
                assert!(is_changed || size == [1, 1] || mode == FinishMode::Auto);
            }
        }
    }
}

#[test]
fn every_adapter_relights_as_the_cpu_does() {
    let cases = [([1, 1], None), ([17, 9], None), ([203, 77], Some([3, 5, 190, 66]))];
    for gpu in test_gpus("every_adapter_relights_as_the_cpu_does") {
        for (seed, ((size, valid), format)) in
            (0..).zip(cases.into_iter().flat_map(|case| FORMATS.map(|format| (case, format))))
        {
            let mut key = key(
                noise(format, size[0], size[1], seed),
                Plane::default(),
                velocity_noise(size[0], size[1], 3, seed),
            );
            if let Some([x, y, width, height]) = valid {
                key.valid = Rect { x, y, width, height };
            }
            let map = map_of(&key);
            let tiles = [key.valid.width, key.valid.height].map(|side| side.div_ceil(TILE));
            let gains = plane(tiles[0], tiles[1], |x, y| {
                relight::gain(format, (hash(x, y, seed) % 1200).cast_signed() - 600)
            });
            let passes = Passes { relights: true, ..Passes::default() };
            let mut backend = GpuBackend::new(&gpu, format, Method::Gather, passes).unwrap();
            backend.take_key(&key, &map).unwrap();
            let phase = Phase::from_f64(0.37);
            let plain = on_cpu(Method::Gather, &[&key], phase);
            let mut expected = plain.clone();
            relight::relight(&pool(1), &gains, key.valid, &mut expected);
            assert!(size == [1, 1] || expected != plain, "there is something to compare");
            let gains = Some(&gains);
            let frame = FrameInput { gains, ..input(Method::Gather, phase, &[], &key, &map) };
            let mut made = key.color.clone();
            backend.make(&frame, &mut made, false).unwrap();
            assert_eq!(difference(&made, &expected), None, "{format:?} {size:?} on {}", gpu.name());
        }
    }
}
