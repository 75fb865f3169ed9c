//! `foreframe check`: whether the engine still makes of a capture what it made before.

use std::fs;
use std::io::Write as _;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use foreframe_engine::backend::choice::BackendChoice;
use foreframe_engine::{FinishConfig, Method};
use foreframed::{clock, gpu};
use serde::Serialize;

use super::score::{Methods, all_processors, parse_methods};
use crate::check::{Baseline, Comparison, Demand, junit};
use crate::options::{parse_count, parse_ratio};
use crate::output::Output;
use crate::recording::Recording as _;
use crate::recording::capture::CaptureRecording;
use crate::score::run::{ScoreOptions, score_recording};
use crate::whole_file;

/// Arguments of `foreframe check`.
#[derive(clap::Args, Debug)]
#[command(after_help = "\
Frames of the capture are left out and predicted, as `score` does it. Make the baseline once
with --write, keep it beside your code, and let CI run the same line without it: no GPU is
needed, and the same capture gives the same digest on every machine, with every backend and any
number of threads.

    foreframe check cart.mcap --baseline cart.json --write
    foreframe check cart.mcap --baseline cart.json --junit cart.xml

Quality may be lost by 0.05 dB of PSNR below 50 dB, 0.5 dB in the worst tile, 0.001 of SSIM and
of FLIP and 0.05 levels of flicker. After a change of Foreframe that is meant to change pictures,
--quality-alone asks whether they became worse.

Exit code 1: bytes or quality are not what they were.")]
pub struct Args {
    /// Capture whose every frame is a picture of the application.
    #[arg(value_name = "FILE.mcap")]
    pub capture: PathBuf,
    /// What to compare with.
    #[arg(long, value_name = "FILE.json")]
    pub baseline: PathBuf,
    /// Write the baseline, in place of one that is there, and compare nothing.
    #[arg(long, conflicts_with_all = ["junit", "quality_alone"])]
    pub write: bool,
    /// With --write, take every N-th frame as a key and predict the others [default: 2]
    #[arg(long, value_name = "N", value_parser = parse_ratio, requires = "write")]
    #[arg(allow_negative_numbers = true)]
    pub ratio: Option<NonZeroUsize>,
    /// With --write, the methods to keep: names with commas between, or all [default: linear,auto]
    #[arg(long, value_name = "A,B", value_parser = parse_methods, requires = "write")]
    pub methods: Option<Methods>,
    /// Let bytes differ, and fail only where quality is lost.
    #[arg(long)]
    pub quality_alone: bool,
    /// Write the result as JUnit XML, too: a case per digest and metric.
    #[arg(long, value_name = "OUT.xml")]
    pub junit: Option<PathBuf>,
    /// What makes the frames, which does not change them: auto, cpu, gpu or gpu:NAME.
    #[arg(long, default_value_t = BackendChoice::Cpu)]
    pub backend: BackendChoice,
    /// Threads of the engine, which do not change the result [default: as many as there are
    /// processors]
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub threads: Option<NonZeroUsize>,
}

/// Frames from key to key of a new baseline.
const RATIO: NonZeroUsize = NonZeroUsize::new(2).expect("2 is not 0");
/// Methods of a new baseline.
const METHODS: [Method; 2] = [Method::Linear, Method::Auto];

/// A baseline that was written.
#[derive(Serialize)]
struct Written<'a> {
    written: String,
    #[serde(flatten)]
    baseline: &'a Baseline,
}

/// Compares, or writes the baseline.
///
/// # Errors
/// If a file cannot be read or written, the baseline is of another capture, or something regressed.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let file = args.baseline.display();
    ensure_three_files(args)?;
    if args.write {
        Baseline::ensure_replaceable(&args.baseline)?;
        let mut written = whole_file::beside(&args.baseline)?;
        let methods = args.methods.as_ref().map_or(METHODS.to_vec(), |methods| methods.0.clone());
        let found = measure(args, output, args.ratio.unwrap_or(RATIO), methods)?;
        written
            .write_all(found.to_text()?.as_bytes())
            .with_context(|| format!("writing {file}"))?;
        whole_file::put(written, &args.baseline)?;
        let text = format!(
            "{file}: {} frames of `{}` by {} methods",
            found.frames,
            found.capture,
            found.methods.len()
        );
        return output.result(&Written { written: file.to_string(), baseline: &found }, &text);
    }
    let baseline = Baseline::read(&args.baseline)?;
    let (ratio, methods) = baseline.asks_for().with_context(|| file.to_string())?;
    if let Some(path) = &args.junit {
        // What it says is never of a run before.
        fs::write(path, "").with_context(|| format!("writing {}", path.display()))?;
    }
    let found = measure(args, output, ratio, methods)?;
    baseline.ensure_same_capture(&found).with_context(|| file.to_string())?;
    let demand = if args.quality_alone { Demand::Quality } else { Demand::SameBytes };
    let comparison = Comparison::new(&baseline, &found, demand);
    if let Some(path) = &args.junit {
        fs::write(path, junit(&comparison)?)
            .with_context(|| format!("writing {}", path.display()))?;
    }
    output.result(&comparison, &comparison.to_text())?;
    let (compared, failed) = comparison.counts();
    if failed > 0 {
        bail!(
            "{}: {failed} of {compared} are not what {file} has: if that is meant, --write makes it \
             anew",
            args.capture.display()
        );
    }
    Ok(())
}

/// That no file would be written over another of them.
fn ensure_three_files(args: &Args) -> anyhow::Result<()> {
    let mut files = vec![("capture", &args.capture), ("--baseline", &args.baseline)];
    files.extend(args.junit.iter().map(|path| ("--junit", path)));
    let place = |path: &Path| fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    for (i, (name, path)) in files.iter().enumerate() {
        for (other, other_path) in &files[..i] {
            ensure!(
                place(path) != place(other_path),
                "{name}: expected another file than that of {other}, found {}",
                path.display()
            );
        }
    }
    Ok(())
}

/// Scores the capture.
fn measure(
    args: &Args,
    output: &Output,
    ratio: NonZeroUsize,
    methods: Vec<Method>,
) -> anyhow::Result<Baseline> {
    let path = args.capture.display();
    let mut recording = CaptureRecording::open(&args.capture)?;
    for warning in recording.warnings()? {
        eprintln!("foreframe: {path}: {warning}");
    }
    let options = ScoreOptions {
        methods,
        ratio,
        backends: vec![gpu::open(&args.backend).context("--backend")?],
        threads: args.threads.unwrap_or_else(all_processors),
        timer: clock::now,
        kept_frames: 0,
        finish: FinishConfig::default(),
        retina: false,
        late_camera: false,
    };
    let name = recording.name().to_owned();
    let progress =
        output.progress("checking", recording.heads().len().div_ceil(ratio.get()) as u64);
    let score = score_recording(&name, &mut recording, &options, || progress.inc(1))
        .with_context(|| format!("checking {path}"))?;
    progress.finish_and_clear();
    let content = recording.content_hash()?;
    Baseline::new(&score, content).with_context(|| {
        format!(
            "{path}: expected frames between two keys, found none: of {ratio} frames one is a key"
        )
    })
}
