//! The loops that are timed, in turn: keys with their frames as a stream has them, and plain
//! copies.

use foreframe_engine::{ColorPlane, Engine, EngineConfig, Method, MonoSpan, MonoTime};
use foreframed::clock;

use super::copy::PlainCopy;
use super::keys::{KEY_INTERVAL_S, RenderedKeys};
use super::{Backend, Settings};

/// Keys that are run before the first of a round that counts: buffers get their sizes, clocks
/// their speed, caches what a stream leaves in them, and methods the history that they need.
///
/// A round is the rest of the sequence of keys. After it come as many plain copies: in turn, as
/// machines change their speed, but not in between, as a copy empties the caches that a stream
/// finds full.
const WARM_UP: usize = 4;

/// Times of one case, one entry per key or frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Times {
    /// Taking in a key.
    pub(super) key: Vec<MonoSpan>,
    /// Making an in-between frame.
    pub(super) frame: Vec<MonoSpan>,
    /// A key and its first two frames; empty where it has fewer.
    pub(super) key_and_two: Vec<MonoSpan>,
    /// A key and all of its frames.
    pub(super) total: Vec<MonoSpan>,
    /// The plain copy for a key.
    pub(super) key_copy: Vec<MonoSpan>,
    /// The plain copy for a frame.
    pub(super) frame_copy: Vec<MonoSpan>,
    /// Why the CPU took over, if it did.
    pub(super) fell_back: Option<String>,
}

/// Times one case.
pub(super) fn time_case(
    rendered: &RenderedKeys,
    method: Method,
    backend: &Backend,
    settings: &Settings,
    copy: &mut PlainCopy,
) -> anyhow::Result<Times> {
    let config = EngineConfig::new(method, settings.threads);
    let mut engine = Engine::new(rendered.format, config);
    if let Some(gpu) = &backend.gpu {
        engine.use_gpu(gpu);
    }
    let bytes = rendered.bytes();
    let mut out = ColorPlane::default();
    let mut times = Times::default();
    let interval = MonoSpan::from_secs_f64(KEY_INTERVAL_S);
    let frames = settings.frames.get() as i64;
    // A method that interpolates has work between the keys before, and none after the newest.
    let behind = if method.interpolates() { interval } else { MonoSpan::ZERO };
    let mut index = 0;
    let mut take_key = |place: usize| -> anyhow::Result<Vec<MonoTime>> {
        let content_time = MonoTime::from_ns(1_000_000_000) + interval.scale(index as i64, 1);
        let mut input = rendered.keys[place].as_input();
        input.index = index as u64;
        input.content_time = content_time;
        input.motion_from = Some(content_time - interval);
        index += 1;
        let mut ends = Vec::with_capacity(settings.frames.get() + 2);
        ends.push(clock::now());
        engine.push_key(&input)?;
        ends.push(clock::now());
        for frame in 1..=frames {
            let shown = content_time + interval.scale(frame, frames + 1) - behind;
            engine.synthesise(shown, &mut out);
            ends.push(clock::now());
        }
        Ok(ends)
    };
    let mut left = settings.keys.get();
    while left > 0 {
        for place in 0..WARM_UP {
            take_key(place)?;
        }
        let round = left.min(rendered.keys.len() - WARM_UP);
        for place in WARM_UP..WARM_UP + round {
            times.add_key(&take_key(place)?);
        }
        for _ in 0..round {
            let starts_at = clock::now();
            copy.copy(bytes.key() / 2);
            let key_copied_at = clock::now();
            copy.copy(bytes.frame() / 2);
            times.key_copy.push(key_copied_at - starts_at);
            times.frame_copy.push(clock::now() - key_copied_at);
        }
        left -= round;
    }
    times.fell_back.clone_from(&engine.backend().fell_back);
    Ok(times)
}

impl Times {
    /// Adds one key: when it was handed over, when it was taken in, and when each of its frames was
    /// ready.
    fn add_key(&mut self, ends: &[MonoTime]) {
        let [started_at, taken_at, ..] = *ends else { return };
        self.key.push(taken_at - started_at);
        self.frame.extend(ends[1..].windows(2).map(|pair| pair[1] - pair[0]));
        self.key_and_two.extend(ends.get(3).map(|&second| second - started_at));
        self.total.extend(ends.last().map(|&last| last - started_at));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_span_lies_between_the_instants_that_it_is_named_after() {
        let at = |ms: &[i64]| -> Vec<MonoTime> {
            ms.iter().map(|&ms| MonoTime::ZERO + MonoSpan::from_ms(ms)).collect()
        };
        let ms = |spans: &[i64]| -> Vec<MonoSpan> {
            spans.iter().map(|&ms| MonoSpan::from_ms(ms)).collect()
        };
        let mut times = Times::default();
        times.add_key(&at(&[10, 13, 18, 25, 40]));
        times.add_key(&at(&[50, 51, 53]));
        assert_eq!(times.key, ms(&[3, 1]));
        assert_eq!(times.frame, ms(&[5, 7, 15, 2]));
        assert_eq!(times.key_and_two, ms(&[15]), "the second key has one frame");
        assert_eq!(times.total, ms(&[30, 3]));
    }
}
