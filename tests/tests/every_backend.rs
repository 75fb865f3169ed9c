//! One scene, one digest: on the CPU with and without its widest registers and with any number of
//! threads, and on every GPU adapter there is.

mod rendered;

use std::fmt;
use std::num::NonZeroUsize;
use std::sync::Arc;

use foreframe_engine::backend::gpu::Gpu;
use foreframe_engine::backend::gpu::test_adapters::test_gpus;
use foreframe_engine::{ColorPlane, Engine, EngineConfig, Method, MonoTime, Simd};
use foreframe_fixtures::{SCENES, Size};
use foreframe_replay::virtual_time::digest::FrameDigester;
use rendered::{INTERVAL, Rendered};

const SIZE: Size = Size { width: 96, height: 54 };
const RATIOS: [f64; 2] = [1.5, 2.0];
const KEYS: u32 = 3;

/// What one digest is made by.
#[derive(Clone, Copy)]
enum Way<'a> {
    /// One thread of the CPU, with no more than every processor of its architecture has.
    Portable,
    /// The same with AVX2, where the processor has it.
    Avx2,
    /// The CPU, with all that it has.
    Widest { threads: usize },
    /// A GPU adapter, after decode on the CPU.
    Gpu(&'a Arc<Gpu>),
}

impl fmt::Display for Way<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Portable => f.write_str("portable CPU"),
            Self::Avx2 => f.write_str("CPU with AVX2"),
            Self::Widest { threads } => write!(f, "CPU with {threads} threads"),
            Self::Gpu(gpu) => f.write_str(gpu.name()),
        }
    }
}

/// The digest of two frames after each key.
fn digest(rendered: &Rendered, method: Method, way: Way<'_>) -> String {
    let mut config = EngineConfig::new(method, NonZeroUsize::MIN);
    match way {
        Way::Portable => config.simd = Simd::Portable,
        Way::Avx2 => config.simd = Simd::Avx2,
        Way::Widest { threads } => {
            config.threads = NonZeroUsize::new(threads).expect("a positive number");
        }
        Way::Gpu(_) => (),
    }
    let mut engine = Engine::new(rendered.format, config);
    if let Way::Gpu(gpu) = way {
        engine.use_gpu(gpu);
    }
    let mut digester = FrameDigester::default();
    let mut picture = ColorPlane::default();
    for index in 0..rendered.keys.len() {
        let content_time = MonoTime::ZERO + INTERVAL.scale(index as i64 + 1, 1);
        rendered.with_input(index, content_time, |input| {
            engine.push_key(input).expect("the key is as declared");
        });
        // A method that interpolates looks back from its key.
        let sign = if method.interpolates() { -1 } else { 1 };
        for third in [1, 2] {
            let shown_at = content_time + INTERVAL.scale(sign * third, 3);
            engine.synthesise(shown_at, &mut picture).expect("a key was taken in");
            digester.add(&picture);
        }
    }
    assert_eq!(engine.backend().fell_back, None, "{method}");
    digester.all()
}

#[test]
fn every_scene_has_one_digest_on_the_cpu_and_on_every_adapter() {
    let gpus = test_gpus("every_scene_has_one_digest_on_the_cpu_and_on_every_adapter");
    let ways: Vec<_> = [1, 2, 5]
        .into_iter()
        .map(|threads| Way::Widest { threads })
        .chain([Way::Avx2])
        .chain(gpus.iter().map(Way::Gpu))
        .collect();
    for scene in SCENES {
        let rendered = Rendered::new(scene, SIZE, RATIOS, KEYS);
        for method in Method::ALL {
            let expected = digest(&rendered, method, Way::Portable);
            for way in &ways {
                assert_eq!(
                    digest(&rendered, method, *way),
                    expected,
                    "{}: {method}, {way}",
                    scene.name
                );
            }
        }
    }
}

#[test]
fn one_pixel_of_one_key_makes_another_digest_on_every_way() {
    let gpus = test_gpus("one_pixel_of_one_key_makes_another_digest_on_every_way");
    let mut rendered = Rendered::new(&SCENES[0], SIZE, RATIOS, KEYS);
    let before = digest(&rendered, Method::Linear, Way::Portable);
    let middle = rendered.keys[1].color.rgba.len() / 8 * 4;
    rendered.keys[1].color.rgba[middle] ^= 1;
    let cpu = [Way::Portable, Way::Avx2, Way::Widest { threads: 1 }];
    for way in cpu.into_iter().chain(gpus.iter().map(Way::Gpu)) {
        assert_ne!(digest(&rendered, Method::Linear, way), before, "{way}");
    }
}
