//! What the linear method costs on a GPU adapter, beside what it cannot do without on the same
//! adapter: a plain upload of a key's planes, one gather, two scatters.
//!
//! Prints medians: `cargo bench -p foreframe-tests --bench gpu_against_plain [-- ADAPTER [SCENE]]`,
//! the adapter and the scene by a part of their names. Decode runs on the CPU whatever the backend
//! and is taken off: it is what the method `hold`, which sends nothing, needs for the same key. The
//! time of a frame has the way back to the CPU in it, the plain passes have none.

#[path = "../../tests/rendered/mod.rs"]
mod rendered;

mod plain;

use std::num::NonZeroUsize;
use std::thread;

use anyhow::Context as _;
use foreframe_engine::backend::gpu::{Gpu, adapters};
use foreframe_engine::decode::{DecodeScratch, decode_key};
use foreframe_engine::{ColorPlane, Engine, EngineConfig, KeyFrame, Method, MonoSpan, MonoTime};
use foreframe_fixtures::{SCENES, Size};
use foreframed::clock;
use plain::PlainPasses;
use rendered::{INTERVAL, Rendered};

const SIZE: Size = Size { width: 1920, height: 1080 };
const KEYS: u32 = 2;
const WARM_UP: usize = 2;
const ROUNDS: usize = 15;

fn main() -> anyhow::Result<()> {
    let names: Vec<_> = std::env::args().skip(1).filter(|name| name != "--bench").collect();
    let name = |i: usize| names.get(i).map_or(String::new(), |name| name.to_lowercase());
    let is_meant = |found: &str, wanted: usize| found.to_lowercase().contains(&name(wanted));
    let scene = SCENES.iter().find(|scene| is_meant(scene.name, 1)).context("no such scene")?;
    let rendered = Rendered::new(scene, SIZE, [2.0, 2.0], KEYS);
    println!("linear, {}, {SIZE}, depth and motion at half resolution, ms", scene.name);
    for adapter in adapters() {
        if adapter.facts.unusable.is_none() && is_meant(&adapter.facts.name, 0) {
            compare(&adapter.facts.name, &Gpu::open(&adapter)?, &rendered)?;
        }
    }
    Ok(())
}

fn compare(name: &str, gpu: &std::sync::Arc<Gpu>, rendered: &Rendered) -> anyhow::Result<()> {
    let plain = PlainPasses::open(name, &decoded(rendered)?)?;
    let threads = thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let engine = |method| Engine::new(rendered.format, EngineConfig::new(method, threads));
    let (mut ours, mut decode) = (engine(Method::Linear), engine(Method::Hold));
    ours.use_gpu(gpu);
    let mut picture = ColorPlane::default();
    let mut times: [Vec<MonoSpan>; 7] = Default::default();
    for round in 0..WARM_UP + ROUNDS {
        let content_time = MonoTime::ZERO + INTERVAL.scale(round as i64 + 1, 1);
        let plain = plain.round()?;
        let mut pushed = [MonoSpan::ZERO; 2];
        rendered.with_input(round % KEYS as usize, content_time, |input| {
            for (engine, time) in [&mut decode, &mut ours].into_iter().zip(&mut pushed) {
                let started_at = clock::now();
                engine.push_key(input).expect("the key is as declared");
                *time = clock::now() - started_at;
            }
        });
        let started_at = clock::now();
        ours.synthesise(content_time + INTERVAL.scale(1, 2), &mut picture);
        let frame = clock::now() - started_at;
        if round >= WARM_UP {
            let [gather, depth, source] = plain.passes;
            let [decode, key] = pushed;
            let spans = [plain.upload, gather, depth, source, decode, key, frame];
            times.iter_mut().zip(spans).for_each(|(times, span)| times.push(span));
        }
    }
    anyhow::ensure!(ours.backend().fell_back.is_none(), "{name}: {:?}", ours.backend());
    let [upload, gather, depth, source, decode, key, frame] = times.map(median);
    let sum = upload + gather + depth + source;
    println!("{name}");
    println!(
        "  plain    {sum:6.1} = upload {upload:.1} + gather {gather:.1} + scatters {depth:.1}, {source:.1}"
    );
    let made = key - decode + frame;
    println!(
        "  linear   {made:6.1} = key {key:.1} - its decode {decode:.1} + in-between {frame:.1}"
    );
    println!("  ratio    {:6.2}", made / sum);
    Ok(())
}

/// The first key as an engine has it.
fn decoded(rendered: &Rendered) -> anyhow::Result<KeyFrame> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut key = KeyFrame::default();
    let mut result = Ok(Default::default());
    rendered.with_input(0, MonoTime::ZERO + INTERVAL, |input| {
        let mut scratch = DecodeScratch::default();
        result = decode_key(&pool, &rendered.format, input, None, &mut scratch, &mut key);
    });
    result?;
    Ok(key)
}

fn median(mut spans: Vec<MonoSpan>) -> f64 {
    spans.sort_unstable();
    spans[spans.len() / 2].as_ms_f64()
}
