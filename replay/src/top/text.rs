//! A status in plain text.

use std::fmt::Write as _;

use foreframed::control::{DaemonStatus, Spread, StreamStatus};

/// Names of the classes of headroom.
pub const HEADROOM: [&str; 6] = ["late", "< 1", "< 2", "< 4", "< 8", "more"];

/// What a daemon does, in a few lines a stream.
#[must_use]
pub fn status(status: &DaemonStatus) -> String {
    let mut out = headline(status);
    out.push('\n');
    for stream in &status.streams {
        // Writing to a string cannot fail.
        let _infallible = write!(out, "\n{}\n", stream_text(stream));
    }
    if status.streams.is_empty() {
        out.push_str("no streams\n");
    }
    out
}

/// The daemon itself, in one line.
#[must_use]
pub fn headline(status: &DaemonStatus) -> String {
    let DaemonStatus { version, method, sink, refresh_hz, clients, .. } = status;
    let mut line = format!(
        "foreframe {version}, up {:.0} s: {method} to {sink} at {refresh_hz:.2} Hz",
        status.uptime_s
    );
    if let Some(cap) = status.cap_hz {
        let _infallible = write!(line, ", capped at {cap:.2}");
    }
    let _infallible = write!(line, ", {clients} {}", plural(*clients, "client"));
    if let Some(file) = &status.recording {
        let _infallible = write!(line, ", recording to {}", file.display());
    }
    line
}

/// What a stream is, in one line.
#[must_use]
pub fn title(stream: &StreamStatus) -> String {
    let StreamStatus { number, width, height, method, backend, paced_by, .. } = stream;
    let idle = if stream.is_idle { ", idle" } else { "" };
    let display = stream.display.as_ref().map_or(String::new(), |name| format!(", for {name}"));
    format!(
        "stream {number}: {width}x{height}, {method} on {backend}, paced by {paced_by}{display}{idle}"
    )
}

/// The stages of latency by name.
#[must_use]
pub fn stages(stream: &StreamStatus) -> [(&'static str, Spread); 8] {
    let latency = &stream.latency_ms;
    [
        ("waited", latency.waited),
        ("taken in", latency.taken_in),
        ("made", latency.made),
        ("of that, paced", latency.paced),
        ("handed over", latency.handed_over),
        ("until shown", latency.until_shown),
        ("key, in all", latency.whole),
        ("an in-between", latency.synthesis),
    ]
}

/// Which part of the picture goes on by which model, in one line.
#[must_use]
pub fn models(stream: &StreamStatus) -> String {
    let share = |(name, percent): &(String, f64)| format!("{name} {percent:.0} %");
    stream.models_percent.iter().map(share).collect::<Vec<_>>().join(", ")
}

fn stream_text(stream: &StreamStatus) -> String {
    let mut out = title(stream);
    let rates = &stream.rates_hz;
    let _infallible = write!(
        out,
        "\n  a second: {:.1} keys, {:.1} real, {:.1} synthesised, {:.1} repeated, {:.1} dropped; \
         {:.1} % on target",
        rates.keys,
        rates.real,
        rates.synthesised,
        rates.repeated,
        rates.dropped,
        stream.on_target_percent
    );
    let spread =
        |(name, spread): (&str, Spread)| format!("{name} {:.2} ({:.2})", spread.p50, spread.p95);
    let latency = stages(stream).map(spread).join(", ");
    let _infallible = write!(out, "\n  median ms (95 %): {latency}");
    let headroom = HEADROOM.iter().zip(stream.ready_before_refresh);
    let headroom: Vec<_> = headroom.map(|(name, count)| format!("{name}: {count}")).collect();
    let _infallible = write!(out, "\n  ready before its refresh, ms: {}", headroom.join(", "));
    let [received, superseded, refused] = stream.keys;
    let [real, synthesised, repeated, dropped] = stream.frames;
    let _infallible = write!(
        out,
        "\n  since the start: {received} keys ({superseded} superseded, {refused} refused); \
         {real} real, {synthesised} synthesised, {repeated} repeated, {dropped} dropped"
    );
    if !stream.drawn_by.is_empty() {
        let _infallible = write!(out, "\n  its window is drawn by {}", stream.drawn_by);
    }
    if !stream.models_percent.is_empty() {
        let _infallible = write!(out, "\n  models: {}", models(stream));
    }
    for warning in &stream.warnings {
        let _infallible = write!(out, "\n  warning: {warning}");
    }
    out
}

fn plural(count: usize, word: &str) -> String {
    if count == 1 { word.to_owned() } else { format!("{word}s") }
}
