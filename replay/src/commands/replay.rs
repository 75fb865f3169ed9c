//! `foreframe replay`: a capture through the daemon's stream on virtual time, with digests.

use std::fmt::Write as _;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use anyhow::{Context as _, bail};
use foreframe_engine::backend::choice::BackendChoice;
use foreframe_engine::{FinishConfig, FinishMode, Method, MonoSpan};
use foreframed::config::SinkSpec;
use foreframed::gpu;
use foreframed::sink::Sink;
use serde::Serialize;

use super::score::{all_processors, backend_name};
use crate::options::{number, parse_count};
use crate::output::Output;
use crate::recording::Recording as _;
use crate::recording::capture::CaptureRecording;
use crate::recording::display::DisplayOptions;
use crate::recording::keys::KeyReader;
use crate::recording::plan::Plan;
use crate::virtual_time::digest::FrameDigester;
use crate::virtual_time::keys::{KeyTiming, timed_keys, timed_poses, timed_uis};
use crate::virtual_time::{OutputFrame, OutputKind, ReplayConfig, replay};

/// Arguments of `foreframe replay`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The capture.
    #[arg(value_name = "FILE.mcap")]
    pub capture: PathBuf,
    /// How in-between frames are made: hold, blend, voxel, gather, grid, linear,
    /// global, affine, quadratic, world, flow or auto.
    #[arg(long, default_value_t = Method::Linear)]
    pub method: Method,
    /// What makes the pictures, which does not change them: auto, cpu, gpu or gpu:NAME.
    #[arg(long, default_value_t = BackendChoice::Cpu)]
    pub backend: BackendChoice,
    /// Refresh rate of the virtual display, 1 to 1000.
    #[arg(long, value_name = "HZ", default_value_t = 120.0, value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    pub refresh: f64,
    /// Threads of the engine, which do not change the result [default: as many as there are
    /// processors]
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub threads: Option<NonZeroUsize>,
    /// Pixels per degree of visual angle, 1 to 1000; turns on damping of motion that no eye can
    /// follow [default: as in the capture, which is without, unless it was recorded with `--ppd`]
    #[arg(long, value_name = "N", value_parser = number(1.0, 1000.0), allow_negative_numbers = true)]
    pub ppd: Option<f64>,
    /// Blur in in-between frames, made up for in their keys: off, on, or auto, as far as no flicker
    /// is seen.
    #[arg(long, default_value_t = FinishMode::Off)]
    pub finish: FinishMode,
    /// With --finish, blur all of an in-between frame, not only where its motion is not to be
    /// relied on; sharper where things move.
    #[arg(long, requires = "finish")]
    pub finish_whole: bool,
    /// Leave out in-between frames until something has moved by so many pixels, 0 to 16.
    #[arg(long, value_name = "PX", default_value_t = 0.0, value_parser = number(0.0, 16.0))]
    #[arg(allow_negative_numbers = true)]
    pub least_step: f64,
    /// Display that the output is for: a built-in profile (see `perception displays`) or a file
    /// that ends in .toml. Without --ppd it gives that too, from 65 cm before a screen. It wins
    /// over the one that the application named [default: that one]
    #[arg(long, value_name = "NAME")]
    pub profile: Option<String>,
    /// Folder of display profiles, files that end in .toml, that the capture may name beside the
    /// built-in ones.
    #[arg(long, value_name = "DIR")]
    pub profiles: Option<PathBuf>,
    /// Take every N-th frame as a key, from frame 0, and leave out the others.
    #[arg(long, value_name = "N", default_value = "1", value_parser = parse_count)]
    #[arg(allow_negative_numbers = true)]
    pub ratio: NonZeroUsize,
    /// Where output frames go: null, png:DIR or y4m:PATH.
    #[arg(long, default_value = "null", value_parser = parse_sink)]
    pub sink: SinkSpec,
    /// Keys arrive when they arrived at the recorder. The default.
    #[arg(long, conflicts_with = "step")]
    pub as_recorded: bool,
    /// Keys arrive in step with their content times, without the jitter of the recording.
    #[arg(long)]
    pub step: bool,
}

/// Standard output holds the digests, and nobody can subscribe to a replay or watch virtual time.
fn parse_sink(spec: &str) -> Result<SinkSpec, String> {
    match spec.parse()? {
        SinkSpec::Shm | SinkSpec::Y4mStdout | SinkSpec::Window => {
            Err(format!("expected null, png:DIR or y4m:PATH, found `{spec}`"))
        }
        sink => Ok(sink),
    }
}

/// Everything that was replayed.
#[derive(Clone, Debug, Serialize)]
struct Replayed {
    digest: String,
    method: &'static str,
    backend: String,
    keys: usize,
    refused: usize,
    superseded: u64,
    dropped: u64,
    frames: Vec<ReplayedFrame>,
}

/// One refresh of the virtual display. Times of presentation count from the first one.
#[derive(Clone, Debug, Serialize)]
struct ReplayedFrame {
    present_at_ns: i64,
    content_time_ns: u64,
    key: u64,
    phase: f64,
    kind: OutputKind,
    digest: String,
}

/// Replays the capture and prints a line per output frame, or JSON.
///
/// # Errors
/// If the capture cannot be read, or a frame cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let name = args.capture.display();
    let mut recording = CaptureRecording::open(&args.capture)?;
    for warning in recording.warnings()? {
        eprintln!("foreframe: {name}: {warning}");
    }
    if recording.heads().is_empty() {
        bail!("{name}: expected at least one whole frame, found none");
    }
    let plan = Plan::new(recording.heads(), args.ratio);
    let reader = KeyReader::new(recording.format(), &plan)?;
    let refresh_interval = MonoSpan::from_hz(args.refresh);
    let timing = if args.step { KeyTiming::Stepped } else { KeyTiming::AsRecorded };
    let said = DisplayOptions::read(args.profile.as_deref(), args.profiles.as_deref())?;
    #[expect(clippy::cast_possible_truncation, reason = "a number of 1 to 1000")]
    let ppd = args.ppd.map(|ppd| ppd as f32);
    let display = DisplayOptions { pixels_per_degree: ppd, ..said }.of(&recording)?;
    let config = ReplayConfig {
        method: args.method,
        gpu: gpu::open(&args.backend).context("--backend")?,
        threads: args.threads.unwrap_or_else(all_processors),
        refresh_interval,
        display_origin: if args.step { None } else { recording.display_origin()? },
        pixels_per_degree: display.pixels_per_degree,
        late_cameras: timed_poses(&recording.late_cameras(), recording.heads(), &plan, timing),
        finish: FinishConfig::new(args.finish, display.profile.as_ref(), refresh_interval)
            .whole(args.finish_whole),
        #[expect(clippy::cast_possible_truncation, reason = "a number of 0 to 16")]
        least_step_px: args.least_step as f32,
    };
    let mut sink = Sink::open(&args.sink, reader.format(), refresh_interval, 0)
        .with_context(|| format!("--sink {}", args.sink))?;

    let uis = timed_uis(&recording.ui_arrivals(), recording.heads(), &plan, timing);
    let uis = recording.read_uis(uis);
    let progress = output.progress("replaying", plan.keys.len() as u64);
    let keys = timed_keys(&mut recording, &reader, &plan, timing).inspect(|_| progress.inc(1));
    let mut digester = FrameDigester::default();
    let mut frames: Vec<ReplayedFrame> = Vec::new();
    let mut first = None;
    let mut next_index = 0;
    let losses = replay(*reader.format(), &config, keys, uis, |frame, picture| {
        // A refresh whose picture was dropped showed the one before again.
        let passed = frame.index - next_index;
        next_index = frame.index + 1;
        match frame.kind {
            OutputKind::Repeated => sink.repeat(passed + 1),
            OutputKind::Real | OutputKind::Synthesised => {
                sink.repeat(passed).and_then(|()| sink.write(frame.index, picture))
            }
        }
        .with_context(|| format!("writing output frame {} to {}", frame.index, args.sink))?;
        let origin = *first.get_or_insert(frame.present_at);
        let digest = digester.add(picture);
        frames.push(ReplayedFrame::new(frame, (frame.present_at - origin).as_ns(), digest));
        Ok(())
    })
    .with_context(|| format!("replaying {name}"))?;
    progress.finish_and_clear();
    for refused in &losses.refused {
        eprintln!("foreframe: {name}: refused {refused}");
    }
    if let Some(why) = &losses.fell_back {
        eprintln!("foreframe: {name}: the CPU took over: {why}");
    }
    let replayed = Replayed {
        digest: digester.all(),
        method: args.method.name(),
        backend: backend_name(config.gpu.as_ref()),
        keys: plan.keys.len(),
        refused: losses.refused.len(),
        superseded: losses.superseded,
        dropped: losses.dropped,
        frames,
    };
    output.result(&replayed, &replayed.to_text())
}

impl ReplayedFrame {
    fn new(frame: &OutputFrame, present_at_ns: i64, digest: String) -> Self {
        Self {
            present_at_ns,
            content_time_ns: frame.content_time.as_ns(),
            key: frame.key,
            phase: frame.phase.as_f64(),
            kind: frame.kind,
            digest,
        }
    }
}

impl Replayed {
    fn to_text(&self) -> String {
        let mut text =
            String::from("present ms      content ms    key  phase  kind         digest\n");
        for frame in &self.frames {
            let kind = match frame.kind {
                OutputKind::Real => "real",
                OutputKind::Synthesised => "synthesised",
                OutputKind::Repeated => "repeated",
            };
            let present_ms = MonoSpan::from_ns(frame.present_at_ns).as_ms_f64();
            let content_ms = frame.content_time_ns as f64 / 1e6;
            let ReplayedFrame { key, phase, digest, .. } = frame;
            let _infallible = writeln!(
                text,
                "{present_ms:10.3} {content_ms:15.3} {key:6} {phase:6.3}  {kind:<12} {digest}"
            );
        }
        let Self { digest, method, keys, refused, superseded, dropped, .. } = self;
        let _infallible = writeln!(
            text,
            "{} output frames of {method} from {keys} keys ({refused} refused, {superseded} \
             superseded), {dropped} dropped\n{digest}",
            self.frames.len()
        );
        text
    }
}
