//! `foreframe info`.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use foreframe_protocol::StreamFormat;
use foreframed::capture::{Capture, CaptureInfo};
use serde::Serialize;

use crate::output::Output;

/// Arguments of `foreframe info`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Capture to look into.
    #[arg(value_name = "FILE.mcap")]
    pub file: PathBuf,
    /// Read every frame and check each plane against its hash.
    #[arg(long)]
    pub verify: bool,
}

/// The JSON of `foreframe info`. Names are part of the interface.
#[derive(Serialize)]
struct Report {
    frames: usize,
    width: u32,
    height: u32,
    duration_s: f64,
    gaps: u64,
    truncated: bool,
    planes: Vec<&'static str>,
    camera: bool,
    late_cameras: usize,
    ui_planes: usize,
    name: String,
    source: foreframed::capture::CaptureSource,
    software: String,
    format_version: u32,
    protocol: String,
    size_bytes: u64,
    /// Where and why the file ends early.
    tail: Option<String>,
    /// Parts that could not be used.
    damaged: Vec<String>,
    codecs: Vec<PlanesReport>,
    streams: Vec<StreamReport>,
    /// Frames whose every plane is what was recorded; absent without `--verify`.
    #[serde(skip_serializing_if = "Option::is_none")]
    verified: Option<usize>,
}

#[derive(Serialize)]
struct PlanesReport {
    plane: &'static str,
    count: u64,
    raw_bytes: u64,
    stored_bytes: u64,
    codecs: Vec<&'static str>,
}

#[derive(Serialize)]
struct StreamReport {
    stream: u32,
    frames: usize,
    width: u32,
    height: u32,
    color: &'static str,
    transfer: &'static str,
    depth: Option<String>,
    motion: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// If the file is no capture, or `--verify` found a frame that is not what was recorded.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let named = || args.file.display().to_string();
    let capture = Capture::open(&args.file).with_context(named)?;
    let info = capture.info().with_context(named)?;
    let mut report = Report::new(&info);
    if args.verify {
        let bar = output.progress("verifying", info.frames as u64);
        for frame in capture.frames() {
            frame.with_context(named)?;
            bar.inc(1);
        }
        for number in 0..report.ui_planes {
            capture.ui_pixels(number).with_context(named)?;
        }
        bar.finish_and_clear();
        report.verified = Some(info.frames);
    }
    output.result(&report, &text(&report))
}

impl Report {
    fn new(info: &CaptureInfo) -> Self {
        Self {
            frames: info.frames,
            width: info.width,
            height: info.height,
            duration_s: info.duration_s,
            gaps: info.gaps,
            truncated: info.is_truncated(),
            planes: info.planes.iter().map(|planes| planes.kind.name()).collect(),
            camera: info.camera,
            late_cameras: info.streams.iter().map(|stream| stream.late_cameras).sum(),
            ui_planes: info.streams.iter().map(|stream| stream.ui_planes).sum(),
            name: info.session.name.clone(),
            source: info.session.source,
            software: info.session.software.clone(),
            format_version: info.session.format_version,
            protocol: info.session.protocol.clone(),
            size_bytes: info.size_bytes,
            tail: info.tail.as_ref().map(ToString::to_string),
            damaged: info.damaged.iter().map(ToString::to_string).collect(),
            codecs: info
                .planes
                .iter()
                .map(|planes| PlanesReport {
                    plane: planes.kind.name(),
                    count: planes.count,
                    raw_bytes: planes.raw_bytes,
                    stored_bytes: planes.stored_bytes,
                    codecs: planes.codings.keys().copied().collect(),
                })
                .collect(),
            streams: info
                .streams
                .iter()
                .map(|stream| {
                    let format = &stream.create.format;
                    StreamReport {
                        stream: stream.create.stream,
                        frames: stream.frames,
                        width: format.width,
                        height: format.height,
                        color: format.color.name(),
                        transfer: format.transfer.name(),
                        depth: depth_text(format),
                        motion: motion_text(format),
                    }
                })
                .collect(),
            verified: None,
        }
    }
}

fn depth_text(format: &StreamFormat) -> Option<String> {
    format.depth.map(|depth| format!("{} {}", depth.format, depth.meaning))
}

fn motion_text(format: &StreamFormat) -> Option<String> {
    format.motion.map(|motion| {
        let [x, y] = motion.scale;
        format!("{} {} {} scale {x}, {y}", motion.format, motion.direction, motion.unit)
    })
}

fn text(report: &Report) -> String {
    let mut out = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a string cannot fail.
        writeln!(out, "{name:<10} {value}").unwrap_or_default();
    };
    let Report { frames, width, height, duration_s, .. } = report;
    line("capture", format!("{} ({:?}, by {})", report.name, report.source, report.software));
    line("version", format!("format {}, protocol {}", report.format_version, report.protocol));
    line("frames", format!("{frames} of {width}x{height} over {duration_s:.3} s"));
    line("size", format!("{:.1} MB", report.size_bytes as f64 / 1e6));
    for planes in &report.codecs {
        let ratio = planes.raw_bytes as f64 / planes.stored_bytes.max(1) as f64;
        let stored = planes.stored_bytes as f64 / 1e6;
        let codecs = planes.codecs.join(", ");
        line(
            planes.plane,
            format!("{} planes, {stored:.1} MB, {ratio:.1}:1, {codecs}", planes.count),
        );
    }
    let camera = match (report.camera, report.late_cameras) {
        (false, _) => "no".to_owned(),
        (true, 0) => "yes".to_owned(),
        (true, poses) => format!("yes, and {poses} late poses"),
    };
    line("camera", camera);
    if report.ui_planes > 0 {
        line("ui", format!("{} planes between key frames", report.ui_planes));
    }
    for stream in &report.streams {
        let depth = stream.depth.as_deref().unwrap_or("none");
        let motion = stream.motion.as_deref().unwrap_or("none");
        let StreamReport { stream, frames, color, transfer, .. } = stream;
        line("stream", format!("{stream}: {frames} frames, color {color} {transfer}"));
        line("", format!("depth {depth}; motion {motion}"));
    }
    line("gaps", format!("{} frames not recorded", report.gaps));
    match &report.tail {
        Some(tail) => line("truncated", format!("yes, {tail}")),
        None => line("truncated", "no".to_owned()),
    }
    for damage in &report.damaged {
        line("damaged", damage.clone());
    }
    if let Some(verified) = report.verified {
        line("verified", format!("{verified} frames are what was recorded"));
    }
    out
}
