//! What a picture in a window costs, by the way that it gets there: memory that the compositor
//! reads, or a surface of a GPU adapter. On a compositor without a screen.
//!
//! ```text
//! cargo bench -p foreframe-tests --bench window_ways -- mutter llvmpipe
//! ```
//!
//! Each way has a process of its own, because there is one event loop in a process. Pictures are
//! handed over one after the other, each after word of the one before. `ms of CPU` is that of the
//! whole process, threads of the driver included; `ms of the stream` is what the thread that hands
//! over waits. It is no measure of a GPU where the adapter is a driver that runs on the CPU.

#[path = "../tests/compositors/mod.rs"]
mod compositors;
#[path = "../tests/rendered/mod.rs"]
mod rendered;

use std::env;
use std::num::NonZeroUsize;
use std::process::Command;
use std::sync::Arc;

use anyhow::Context as _;
use compositors::{Compositor, Kind};
use foreframe_engine::backend::gpu::{Gpu, adapters};
use foreframe_engine::{ColorPlane, Engine, EngineConfig, Method, MonoSpan, MonoTime};
use foreframe_fixtures::{SCENES, Size};
use foreframed::clock;
use foreframed::sink::window::{Window, WindowConfig, WindowEvent, WindowOptions, WindowSystem};
use foreframed::stream::core::Told;
use rendered::{INTERVAL, Rendered};
use rustix::time::{ClockId, clock_gettime};

const WAY: &str = "FOREFRAME_BENCH_WAY";
const ADAPTER: &str = "FOREFRAME_BENCH_ADAPTER";
const SIZE: Size = Size { width: 1280, height: 720 };
const PICTURES: u32 = 120;
const WARM_UP: u32 = 20;
/// `upload` goes through a surface from memory, `kept` never leaves the adapter; each beside making
/// the picture alone.
const WAYS: [&str; 5] = ["wl_shm", "upload", "make", "make, upload", "make, kept"];

fn main() -> anyhow::Result<()> {
    if let Ok(way) = env::var(WAY) {
        return measure(&way);
    }
    let mut words = env::args().skip(1).filter(|word| !word.starts_with("--"));
    let kind = match words.next().as_deref() {
        Some("weston") => Kind::Weston,
        _ => Kind::Mutter,
    };
    let adapter = words.next().unwrap_or_else(|| "llvmpipe".to_owned());
    println!("| way | ms of CPU a picture | ms of the stream, p50 | p95 |\n|---|---|---|---|");
    for way in WAYS {
        let started = Compositor::start(kind, [SIZE.width, SIZE.height], 60);
        let compositor = started.context("expected a compositor")?;
        let status = Command::new(env::current_exe()?)
            .envs(compositor.environment.iter().map(|(name, value)| (*name, value)))
            .env(WAY, way)
            .env(ADAPTER, &adapter)
            .status()?;
        anyhow::ensure!(status.success(), "{way}: {status}");
    }
    Ok(())
}

/// Two keys taken in.
fn engine(rendered: &Rendered, gpu: &Arc<Gpu>) -> Engine {
    let threads = NonZeroUsize::new(2).expect("two");
    let mut engine = Engine::new(rendered.format, EngineConfig::new(Method::Linear, threads));
    engine.use_gpu(gpu);
    for key in 0..2 {
        let content_time = MonoTime::ZERO + INTERVAL.scale(key + 1, 1);
        rendered.with_input(key as usize, content_time, |input| {
            engine.push_key(input).expect("the key is as declared");
        });
    }
    engine
}

fn measure(way: &str) -> anyhow::Result<()> {
    let wanted = env::var(ADAPTER)?;
    let adapters = adapters();
    let adapter = adapters.iter().find(|it| it.facts.name.to_lowercase().contains(&wanted));
    let gpu = Gpu::open(adapter.context("expected an adapter of that name")?)?;
    let rendered = Rendered::new(&SCENES[0], SIZE, [2.0; 2], 2);
    let mut engine = way.starts_with("make").then(|| engine(&rendered, &gpu));
    let system = WindowSystem::start(&WindowOptions::default())?;
    let config = WindowConfig { format: rendered.format, title: way.to_owned(), ordinal: 0 };
    let drawn_by = Some(&gpu).filter(|_| way != "wl_shm");
    let mut window = Window::open(&system.opener(), &config, drawn_by, || {})?;
    eprintln!("{way}: {}", window.way());
    let mut frame = ColorPlane::new(rendered.format.color, SIZE.width, SIZE.height);
    frame.as_mut_bytes().copy_from_slice(&rendered.keys[1].color.rgba);
    let mut spans = Vec::new();
    let mut cpu = 0;
    for count in 0..PICTURES + WARM_UP {
        let cpu_before = cpu_ns();
        let started_at = clock::now();
        let shown_at = MonoTime::ZERO + INTERVAL.scale(i64::from(120 + count % 59 + 1), 60);
        let is_taken = match (&mut engine, way) {
            (Some(engine), "make, kept") => {
                let (_, kept) =
                    engine.synthesise_kept(shown_at, &mut frame).context("there are keys")?;
                window.present_kept(started_at, kept.context("it stays")?)
            }
            (Some(engine), _) => {
                engine.synthesise(shown_at, &mut frame).context("there are keys")?;
                way == "make" || window.present(started_at, &frame)
            }
            (None, _) => window.present(started_at, &frame),
        };
        let span = clock::now() - started_at;
        anyhow::ensure!(is_taken, "the window took no picture");
        if way != "make" {
            wait_for_word(&window)?;
        }
        if count >= WARM_UP {
            spans.push(span.as_ns());
            cpu += cpu_ns() - cpu_before;
        }
    }
    spans.sort_unstable();
    let ms = |ns: i64| ns as f64 / 1e6;
    let at = |percent: usize| ms(spans[spans.len() * percent / 100]);
    let cpu = ms(cpu) / f64::from(PICTURES);
    println!("| {way} | {cpu:.2} | {:.2} | {:.2} |", at(50), at(95));
    Ok(())
}

/// Until the picture was shown, or will never be.
fn wait_for_word(window: &Window) -> anyhow::Result<()> {
    let patience = clock::now() + MonoSpan::from_ms(10_000);
    loop {
        for event in window.take_events() {
            if let WindowEvent::Told(Told::Presented { .. } | Told::Discarded { .. }) = event {
                return Ok(());
            }
        }
        anyhow::ensure!(clock::now() < patience, "no word of a picture");
        clock::sleep_until(clock::now() + MonoSpan::from_us(200));
    }
}

/// Time of all processors for this process.
fn cpu_ns() -> i64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}
