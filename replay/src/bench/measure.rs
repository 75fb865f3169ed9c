//! The loop that is timed.

use anyhow::Context as _;
use foreframe_engine::{ColorPlane, Engine, EngineConfig, Method, MonoSpan, MonoTime};
use foreframed::clock;
use rayon::iter::{IndexedParallelIterator as _, ParallelIterator as _};
use rayon::slice::{ParallelSlice as _, ParallelSliceMut as _};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::Settings;
use super::keys::{KEY_INTERVAL_S, RenderedKeys};

/// Keys that are run before the first that counts: buffers get their sizes, clocks their speed.
const WARM_UP: usize = 4;
/// Bytes that one thread copies at a time.
const COPY_CHUNK: usize = 1 << 18;

/// Times of one case, one entry per key or frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Times {
    /// Taking in a key.
    pub(super) key: Vec<MonoSpan>,
    /// Making an in-between frame.
    pub(super) frame: Vec<MonoSpan>,
    /// A key and all of its frames.
    pub(super) total: Vec<MonoSpan>,
    /// Copying the planes of a key.
    pub(super) key_copy: Vec<MonoSpan>,
    /// Copying the colour of a frame.
    pub(super) frame_copy: Vec<MonoSpan>,
}

/// Times one case.
pub(super) fn time_case(
    rendered: &RenderedKeys,
    method: Method,
    settings: &Settings,
) -> anyhow::Result<Times> {
    let config = EngineConfig {
        method,
        threads: settings.threads,
        pixels_per_degree: None,
        worker_started: || (),
        timer: || MonoTime::from_ns(0),
    };
    let mut engine = Engine::new(rendered.format, config);
    let pool = ThreadPoolBuilder::new().num_threads(settings.threads.get()).build();
    let pool = pool.context("starting the threads of the plain copy")?;
    let mut copies = vec![Vec::new(); 4];
    let mut out = ColorPlane::default();
    let mut times = Times::default();
    let interval = MonoSpan::from_secs_f64(KEY_INTERVAL_S);
    for index in 0..WARM_UP + settings.keys.get() {
        let key = &rendered.keys[index % rendered.keys.len()];
        let content_time = MonoTime::from_ns(1_000_000_000) + interval.scale(index as i64, 1);
        let mut input = key.as_input();
        input.index = index as u64;
        input.content_time = content_time;
        input.motion_from = Some(content_time - interval);
        let counts = index >= WARM_UP;
        let started_at = clock::now();
        engine.push_key(&input)?;
        let taken_at = clock::now();
        let mut before = taken_at;
        let frames = settings.frames.get() as i64;
        for frame in 1..=frames {
            engine.synthesise(content_time + interval.scale(frame, frames + 1), &mut out);
            let made_at = clock::now();
            if counts {
                times.frame.push(made_at - before);
            }
            before = made_at;
        }
        if counts {
            times.key.push(taken_at - started_at);
            times.total.push(before - started_at);
        }
        let planes = [Some(&key.color), key.depth.as_ref(), key.motion.as_ref()];
        let started_at = clock::now();
        for (plane, copy) in planes.into_iter().flatten().zip(&mut copies) {
            copy_bytes(&pool, &plane.bytes, copy);
        }
        let copied_at = clock::now();
        copy_bytes(&pool, &key.color.bytes, &mut copies[3]);
        if counts {
            times.key_copy.push(copied_at - started_at);
            times.frame_copy.push(clock::now() - copied_at);
        }
    }
    Ok(times)
}

fn copy_bytes(pool: &ThreadPool, from: &[u8], to: &mut Vec<u8>) {
    to.resize(from.len(), 0);
    pool.install(|| {
        let parts = to.par_chunks_mut(COPY_CHUNK).zip(from.par_chunks(COPY_CHUNK));
        parts.for_each(|(to, from)| to.copy_from_slice(from));
    });
}
