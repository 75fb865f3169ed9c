//! What the bench tells: a table, or JSON.

use foreframe_engine::{Method, MonoSpan};
use foreframe_fixtures::Size;
use serde::Serialize;

use super::Settings;
use super::keys::MovedBytes;
use super::measure::Times;

/// Everything that was timed.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Report {
    /// What the engine ran on.
    pub backend: &'static str,
    /// Threads of the engine and of the plain copy.
    pub threads: usize,
    /// In-between frames after each key.
    pub frames_per_key: usize,
    /// Keys that were timed in each case.
    pub keys: usize,
    /// One entry per scene, size and method.
    pub cases: Vec<CaseReport>,
}

/// One scene, size and method. Times are in milliseconds.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct CaseReport {
    /// Name of the scene.
    pub scene: &'static str,
    /// Columns of colour.
    pub width: u32,
    /// Rows of colour.
    pub height: u32,
    /// Name of the method.
    pub method: &'static str,
    /// Taking in a key.
    pub key_ms: Percentiles,
    /// Making an in-between frame.
    pub frame_ms: Percentiles,
    /// A key and all of its in-between frames.
    pub total_ms: Percentiles,
    /// A plain copy of the planes of a key.
    pub key_copy_ms: Percentiles,
    /// A plain copy of the colour of a frame.
    pub frame_copy_ms: Percentiles,
    /// Bytes that a key has to move at least: its planes, read and written.
    pub key_bytes: usize,
    /// Bytes that an in-between frame has to move at least: colour read and written, field read.
    pub frame_bytes: usize,
    /// Median of a frame over the median of the plain copy.
    pub frame_per_copy: f64,
    /// Keys and in-between frames per second that one stream could have.
    pub frames_per_second: f64,
}

/// Of one series of times, in milliseconds.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Percentiles {
    /// Half of the times are below.
    pub p50: f64,
    /// 95 % of the times are below.
    pub p95: f64,
    /// 99 % of the times are below.
    pub p99: f64,
}

impl Percentiles {
    fn of(times: &[MonoSpan]) -> Self {
        let mut ms: Vec<_> = times.iter().map(|time| time.as_secs_f64() * 1e3).collect();
        ms.sort_by(f64::total_cmp);
        let at = |share: usize| ms.get(ms.len() * share / 100).copied().unwrap_or(f64::NAN);
        Self { p50: at(50), p95: at(95), p99: at(99) }
    }
}

impl CaseReport {
    pub(super) fn new(
        scene: &'static str,
        size: Size,
        method: Method,
        bytes: &MovedBytes,
        times: &Times,
    ) -> Self {
        let [frame, copy, total] =
            [&times.frame, &times.frame_copy, &times.total].map(|times| Percentiles::of(times));
        let frames_per_key = times.frame.len() / times.key.len().max(1);
        Self {
            scene,
            width: size.width,
            height: size.height,
            method: method.name(),
            key_ms: Percentiles::of(&times.key),
            frame_ms: frame,
            total_ms: total,
            key_copy_ms: Percentiles::of(&times.key_copy),
            frame_copy_ms: copy,
            key_bytes: 2 * bytes.key,
            frame_bytes: 2 * bytes.color + bytes.field,
            frame_per_copy: frame.p50 / copy.p50,
            frames_per_second: (frames_per_key + 1) as f64 * 1e3 / total.p50,
        }
    }
}

impl Report {
    pub(super) fn new(settings: &Settings, cases: Vec<CaseReport>) -> Self {
        Self {
            backend: "cpu",
            threads: settings.threads.get(),
            frames_per_key: settings.frames.get(),
            keys: settings.keys.get(),
            cases,
        }
    }

    /// The table for people.
    #[must_use]
    pub fn to_text(&self) -> String {
        let Self { backend, threads, frames_per_key, keys, cases } = self;
        let mut lines = vec![
            format!(
                "{backend}, {threads} threads, medians over {keys} keys with {frames_per_key} in-between frames each, ms"
            ),
            format!(
                "{:14} {:>9} {:7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>6}",
                "scene", "size", "method", "key", "frame", "p99", "total", "copy", "x copy", "fps"
            ),
        ];
        for case in cases {
            lines.push(format!(
                "{:14} {:>9} {:7} {:7.2} {:7.2} {:7.2} {:7.2} {:7.2} {:7.1} {:6.0}",
                case.scene,
                format!("{}x{}", case.width, case.height),
                case.method,
                case.key_ms.p50,
                case.frame_ms.p50,
                case.frame_ms.p99,
                case.total_ms.p50,
                case.frame_copy_ms.p50,
                case.frame_per_copy,
                case.frames_per_second,
            ));
        }
        lines.join("\n")
    }
}
