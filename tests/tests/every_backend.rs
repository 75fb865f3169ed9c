//! One scene, one digest: on the CPU with and without its widest registers and with any number of
//! threads, and on every GPU adapter there is.

use std::fmt;
use std::num::NonZeroUsize;
use std::sync::Arc;

use foreframe_engine::backend::gpu::Gpu;
use foreframe_engine::backend::gpu::test_adapters::test_gpus;
use foreframe_engine::key::Camera;
use foreframe_engine::{
    ColorPlane, Engine, EngineConfig, KeyInput, Method, MonoSpan, MonoTime, PlaneInput, Rect, Simd,
    StreamFormat,
};
use foreframe_fixtures::client::{CLIENT_MOTION, stream_options};
use foreframe_fixtures::{Recipe, RenderedKey, Renderer, SCENES, SceneInfo, Size};
use foreframe_replay::virtual_time::digest::FrameDigester;
use foreframed::ingest;

const SIZE: Size = Size { width: 96, height: 54 };
const INTERVAL: MonoSpan = MonoSpan::from_ms(25);
const KEYS: u32 = 3;

/// What one digest is made by.
#[derive(Clone, Copy)]
enum Way<'a> {
    /// One thread of the CPU, with no more than every processor of its architecture has.
    Portable,
    /// The CPU, with all that it has.
    Widest { threads: usize },
    /// A GPU adapter, after decode on the CPU.
    Gpu(&'a Arc<Gpu>),
}

impl fmt::Display for Way<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Portable => f.write_str("portable CPU"),
            Self::Widest { threads } => write!(f, "CPU with {threads} threads"),
            Self::Gpu(gpu) => f.write_str(gpu.name()),
        }
    }
}

/// The keys of a scene, and what their stream declares.
struct Rendered {
    format: StreamFormat,
    keys: Vec<RenderedKey>,
}

impl Rendered {
    fn new(scene: &SceneInfo) -> Self {
        let renderer = Renderer::new((scene.build)());
        let recipe = Recipe { depth_ratio: 1.5, motion_ratio: 2.0, ..Recipe::new(SIZE) };
        let message = stream_options(&recipe, CLIENT_MOTION).to_message(1);
        let interval = INTERVAL.as_secs_f64();
        let keys = (1..=KEYS).map(|index| {
            let time = f64::from(index) * interval;
            RenderedKey::render(&renderer, &recipe, time, time - interval)
        });
        Self { format: ingest::stream_format(&message.format), keys: keys.collect() }
    }

    /// The digest of two frames after each key.
    fn digest(&self, method: Method, way: Way<'_>) -> String {
        let mut config = EngineConfig::new(method, NonZeroUsize::MIN);
        match way {
            Way::Portable => config.simd = Simd::Portable,
            Way::Widest { threads } => {
                config.threads = NonZeroUsize::new(threads).expect("a positive number");
            }
            Way::Gpu(_) => (),
        }
        let mut engine = Engine::new(self.format, config);
        if let Way::Gpu(gpu) = way {
            engine.use_gpu(gpu);
        }
        let mut digester = FrameDigester::default();
        let mut picture = ColorPlane::default();
        for (index, key) in (1..).zip(&self.keys) {
            let content_time = MonoTime::ZERO + INTERVAL.scale(index, 1);
            push(&mut engine, key, content_time);
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
}

fn push(engine: &mut Engine, key: &RenderedKey, content_time: MonoTime) {
    let (depth, motion) = (key.depth_bytes(), key.motion_bytes(CLIENT_MOTION));
    let plane = |bytes, size: Size| {
        let pixels = size.width as usize * size.height as usize;
        let bytes: &[u8] = bytes;
        PlaneInput {
            bytes,
            width: size.width,
            height: size.height,
            stride: (bytes.len() / pixels * size.width as usize) as u32,
            valid: Rect::full(size.width, size.height),
            jitter: [0.0; 2],
        }
    };
    let camera = |camera: &foreframe_fixtures::scene::Camera| Camera {
        view: camera.view,
        projection: camera.projection,
    };
    let input = KeyInput {
        index: content_time.as_ns(),
        content_time,
        motion_from: Some(content_time - INTERVAL),
        is_cut: false,
        color: plane(&key.color.rgba, SIZE),
        depth: Some(plane(&depth, key.depth_size)),
        motion: Some(plane(&motion, key.motion_size)),
        camera: Some(camera(&key.camera)),
        motion_from_camera: Some(camera(&key.motion_from_camera)),
    };
    engine.push_key(&input).expect("the key is as declared");
}

#[test]
fn every_scene_has_one_digest_on_the_cpu_and_on_every_adapter() {
    let gpus = test_gpus("every_scene_has_one_digest_on_the_cpu_and_on_every_adapter");
    let ways: Vec<_> = [1, 2, 5]
        .into_iter()
        .map(|threads| Way::Widest { threads })
        .chain(gpus.iter().map(Way::Gpu))
        .collect();
    for scene in SCENES {
        let rendered = Rendered::new(scene);
        for method in Method::ALL {
            let expected = rendered.digest(method, Way::Portable);
            for way in &ways {
                assert_eq!(
                    rendered.digest(method, *way),
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
    let mut rendered = Rendered::new(&SCENES[0]);
    let before = rendered.digest(Method::Linear, Way::Portable);
    let middle = rendered.keys[1].color.rgba.len() / 8 * 4;
    rendered.keys[1].color.rgba[middle] ^= 1;
    let cpu = [Way::Portable, Way::Widest { threads: 1 }];
    for way in cpu.into_iter().chain(gpus.iter().map(Way::Gpu)) {
        assert_ne!(rendered.digest(Method::Linear, way), before, "{way}");
    }
}
