//! Frames between two keys: the method of Falchetto et al. on every adapter.

use super::*;

/// A key that frames lie before: at 60 ms, its motion from the key before at 20 ms.
fn newer(key: KeyFrame) -> KeyFrame {
    let time = |ms: u64| MonoTime::from_ns(ms * 1_000_000);
    KeyFrame { content_time: time(60), motion_from: Some(time(20)), ..key }
}

/// The key before that.
fn older(key: KeyFrame) -> KeyFrame {
    KeyFrame { content_time: MonoTime::from_ns(20_000_000), ..key }
}

/// Frames between `older` and `newer`, after a key of another kind, on `gpu` and on the CPU.
fn between(gpu: &Arc<Gpu>, older: &KeyFrame, newer: &KeyFrame) -> [Vec<ColorPlane>; 2] {
    let phases = || [0.1, 0.37, 0.5, 0.9].into_iter().map(Phase::from_f64);
    let mut backend =
        GpuBackend::new(gpu, newer.color.format(), Method::Voxel, Passes::default()).unwrap();
    for key in [newer, older, newer] {
        backend.take_key(key, &map_of_moving(key)).unwrap();
    }
    let map = map_of_moving(newer);
    let make = |phase| {
        let mut out = newer.color.clone();
        backend.make(&input(Method::Voxel, phase, &[older], newer, &map), &mut out, false).unwrap();
        out
    };
    let made = phases().map(make).collect();
    [made, phases().map(|phase| on_cpu(Method::Voxel, &[older, newer], phase)).collect()]
}

#[test]
fn every_adapter_makes_frames_between_two_keys_as_the_cpu_does() {
    let cases = [
        ([17, 9], [9, 5], [17, 9], 3),
        ([64, 40], [64, 40], [64, 40], 6),
        ([213, 120], [142, 80], [54, 30], 20),
        ([100, 76], [54, 30], [190, 140], 40),
    ];
    for gpu in test_gpus("every_adapter_makes_frames_between_two_keys_as_the_cpu_does") {
        for (seed, (size, cells, before, reach)) in (0..).zip(cases) {
            for format in FORMATS {
                let of = |cells: [u32; 2], seed: u32| {
                    let color = noise(format, size[0], size[1], seed);
                    // Patches that both keys have, so that some of their depths agree.
                    let depth = plane(cells[0], cells[1], |x, y| {
                        let place = [x * 16 / cells[0], y * 16 / cells[1]];
                        let near = (hash(place[0], place[1], 3) % 4) << 20;
                        near + hash(x, y, seed) % (1 << 16)
                    });
                    key(color, depth, velocity_noise(cells[0], cells[1], reach, seed))
                };
                let keys = (older(of(before, seed + 10)), newer(of(cells, seed)));
                let [made, expected] = between(&gpu, &keys.0, &keys.1);
                for (made, expected) in made.iter().zip(&expected) {
                    let found = difference(made, expected);
                    assert_eq!(found, None, "{size:?}, {format:?} on {}", gpu.name());
                }
                // What a comparison would miss if one key alone were read.
                for read in [&keys.0, &keys.1] {
                    assert!(difference(&read.color, &expected[1]).is_some());
                }
            }
        }
    }
}

#[test]
fn every_adapter_minds_what_the_two_keys_around_a_frame_lack() {
    for gpu in test_gpus("every_adapter_minds_what_the_two_keys_around_a_frame_lack") {
        let of = |seed: u32| {
            let color = noise(ColorFormat::Rgba8, 101, 67, seed);
            key(color, depth_noise(43, 31, 5), velocity_noise(43, 31, 9, seed))
        };
        let letterbox = Rect { x: 5, y: 11, width: 83, height: 47 };
        let (before, after) = (older(of(1)), newer(of(2)));
        let still = plane(43, 31, |_, _| Velocity::default());
        let cases = [
            ("one geometry", before.clone(), after.clone()),
            ("jitter", KeyFrame { field_offset: [97, -211], ..before.clone() }, after.clone()),
            ("before in a box", KeyFrame { valid: letterbox, ..before.clone() }, after.clone()),
            ("after in a box", before.clone(), KeyFrame { valid: letterbox, ..after.clone() }),
            (
                "no depth before",
                KeyFrame { depth: Plane::default(), ..before.clone() },
                after.clone(),
            ),
            (
                "no depth after",
                before.clone(),
                KeyFrame { depth: Plane::default(), ..after.clone() },
            ),
            ("nothing moves", before.clone(), KeyFrame { velocity: still, ..after.clone() }),
            (
                "no motion",
                before.clone(),
                KeyFrame { velocity: Plane::default(), motion_from: None, ..after.clone() },
            ),
        ];
        let mut seen: Vec<Vec<ColorPlane>> = Vec::new();
        for (what, before, after) in &cases {
            let [made, expected] = between(&gpu, before, after);
            for (made, expected) in made.iter().zip(&expected) {
                assert_eq!(difference(made, expected), None, "{what} on {}", gpu.name());
            }
            assert!(!seen.contains(&expected), "{what} makes a difference");
            seen.push(expected);
        }
    }
}
