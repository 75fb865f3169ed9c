//! Prints milliseconds per key and per in-between frame, by method and size.
//!
//! Usage: `cargo run --release -p foreframe-engine --example time_methods
//! [-- THREADS [METHOD,..|all [cpu|gpu:NAME]]]`
//!
//! Colour rgba8, depth f32 and motion rg16f at half resolution. The scene is a slanted ground that
//! the camera moves over and a grid of nearer tiles that move across it: everything moves by
//! fractions of a pixel, and about a tenth of the picture is edges. Medians over the frames.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::time::Instant;

use foreframe_engine::backend::choice::{BackendChoice, choose};
use foreframe_engine::backend::gpu::{Gpu, adapters};
use foreframe_engine::format::{
    CameraMotion, DepthConvention, DepthFormat, DepthMeaning, MotionConvention, MotionDirection,
    MotionFormat, MotionUnit,
};
use foreframe_engine::{
    ColorPlane, Engine, EngineConfig, KeyInput, Method, MonoSpan, MonoTime, Pixels, PlaneInput,
    Rect, StreamFormat,
};

const KEYS: u64 = 24;
const KEY_INTERVAL_MS: i64 = 25;

#[expect(clippy::disallowed_methods, reason = "an example that measures has to read a clock")]
fn now() -> MonoTime {
    thread_local! {
        static START: Instant = Instant::now();
    }
    MonoTime::from_ns(START.with(|start| start.elapsed().as_nanos() as u64))
}

/// The planes of one key.
struct Planes {
    color: Vec<u8>,
    depth: Vec<u8>,
    motion: Vec<u8>,
}

fn half_bits(value: f32) -> u16 {
    half::f16::from_f32(value).to_bits()
}

fn planes(width: u32, height: u32, still: bool) -> Planes {
    let mut color = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let texture = (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503)) >> 8;
            color.extend_from_slice(&[texture as u8, (x >> 2) as u8, (y >> 2) as u8, 255]);
        }
    }
    let (mut depth, mut motion) = (Vec::new(), Vec::new());
    for y in 0..height / 2 {
        for x in 0..width / 2 {
            let is_tile = x % 80 < 20 && y % 60 < 20;
            let ground = 0.01 + 0.05 * y as f32 / height as f32;
            depth.extend_from_slice(&(if is_tile { 0.2 } else { ground }).to_le_bytes());
            let speed = if still { 0.0 } else { 1.0 };
            let (dx, dy) = if is_tile { (-7.3, 2.6) } else { (60.0 * ground, 8.0 * ground) };
            motion.extend_from_slice(&half_bits(speed * dx).to_le_bytes());
            motion.extend_from_slice(&half_bits(speed * dy).to_le_bytes());
        }
    }
    Planes { color, depth, motion }
}

/// Median and minimum; the minimum is the better guess on a machine that does other work too.
fn summary(mut times: Vec<f64>) -> [f64; 2] {
    times.sort_by(f64::total_cmp);
    [times[times.len() / 2], times[0]]
}

fn time(
    width: u32,
    height: u32,
    method: Method,
    threads: NonZeroUsize,
    still: bool,
    gpu: Option<&Arc<Gpu>>,
) -> [[f64; 2]; 2] {
    let format = StreamFormat {
        depth: Some(DepthConvention { format: DepthFormat::F32, meaning: DepthMeaning::Reversed }),
        motion: Some(MotionConvention {
            format: MotionFormat::Rg16f,
            direction: MotionDirection::PreviousToCurrent,
            unit: MotionUnit::Pixels,
            scale: [1.0, 1.0],
            camera_motion: CameraMotion::Included,
        }),
        ..StreamFormat::rgba8(width, height)
    };
    let config = EngineConfig { timer: now, ..EngineConfig::new(method, threads) };
    let mut engine = Engine::new(format, config);
    if let Some(gpu) = gpu {
        engine.use_gpu(gpu);
    }
    let planes = planes(width, height, still);
    let plane = |bytes, width: u32, height: u32, bytes_per_pixel: u32| PlaneInput {
        pixels: Pixels::Bytes(bytes),
        width,
        height,
        stride: width * bytes_per_pixel,
        valid: Rect::full(width, height),
        jitter: [0.0; 2],
    };
    let mut out = ColorPlane::default();
    let (mut keys, mut frames) = (Vec::new(), Vec::new());
    for index in 0..KEYS {
        let interval = MonoSpan::from_ms(KEY_INTERVAL_MS);
        let content_time = MonoTime::ZERO + interval.scale(index as i64 + 1, 1);
        let report = engine.push_key(&KeyInput {
            index,
            content_time,
            motion_from: Some(content_time - interval),
            is_cut: false,
            color: plane(&planes.color, width, height, 4),
            depth: Some(plane(&planes.depth, width / 2, height / 2, 4)),
            motion: Some(plane(&planes.motion, width / 2, height / 2, 4)),
            mask: None,
            camera: None,
            motion_from_camera: None,
        });
        keys.push(report.expect("the planes match the format").work.as_ms_f64());
        for third in [1, 2] {
            let at = content_time + interval.scale(third, 3);
            let report = engine.synthesise(at, &mut out).expect("a key was pushed");
            frames.push(report.work.as_ms_f64());
        }
    }
    if let Some(why) = &engine.backend().fell_back {
        println!("the CPU took over: {why}");
    }
    [summary(keys), summary(frames)]
}

fn open(choice: &BackendChoice) -> Option<Arc<Gpu>> {
    let adapters = adapters();
    let facts: Vec<_> = adapters.iter().map(|adapter| adapter.facts.clone()).collect();
    let chosen = choose(choice, &facts, None).expect("an adapter that exists");
    chosen.adapter.map(|index| Gpu::open(&adapters[index]).expect("an adapter that opens"))
}

fn main() {
    let threads = std::env::args().nth(1).and_then(|threads| threads.parse().ok());
    let threads = threads.unwrap_or(NonZeroUsize::MIN.saturating_add(1));
    println!("threads {threads}; median and minimum");
    println!("{:10} {:14} {:>13} {:>13}", "size", "method", "ms/key", "ms/frame");
    let only = std::env::args().nth(2).filter(|only| only != "all");
    let backend = std::env::args().nth(3).unwrap_or_else(|| "cpu".to_owned());
    let gpu = open(&backend.parse().expect("a backend"));
    println!("backend {}", gpu.as_ref().map_or("cpu", |gpu| gpu.name()));
    for (width, height) in [(1280, 720), (1920, 1080)] {
        let cases = Method::ALL.map(|method| (method, false));
        for (method, still) in cases.into_iter().chain([(Method::Linear, true)]) {
            if only.as_ref().is_some_and(|only| only.split(',').all(|one| one != method.name())) {
                continue;
            }
            let [key, frame] = time(width, height, method, threads, still, gpu.as_ref());
            let name = format!("{}{}", method.name(), if still { " (still)" } else { "" });
            let size = format!("{width}x{height}");
            println!(
                "{size:10} {name:14} {:6.2} {:6.2} {:6.2} {:6.2}",
                key[0], key[1], frame[0], frame[1]
            );
        }
    }
}
