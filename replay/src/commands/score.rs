//! `foreframe score`: how good each method's in-between frames are, on captures of a high rate.

use std::fs;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context as _;
use foreframe_engine::backend::choice::BackendChoice;
use foreframe_engine::backend::gpu::Gpu;
use foreframe_engine::{FinishConfig, FinishMode, Method, MonoSpan};
use foreframed::{clock, gpu};

use super::plot;
use crate::options::{number, parse_count, parse_ratio};
use crate::output::Output;
use crate::recording::Recording as _;
use crate::recording::capture::CaptureRecording;
use crate::recording::display::DisplayOptions;
use crate::score::chart::chart;
use crate::score::page::{frames_to_keep, page};
use crate::score::report::Report;
use crate::score::run::{ScoreOptions, score_recording};

/// Arguments of `foreframe score`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Captures whose every frame is a picture of the application.
    #[arg(required = true, value_name = "FILE.mcap")]
    pub captures: Vec<PathBuf>,
    /// Take every N-th frame as a key, from frame 0, and predict the others.
    #[arg(long, value_name = "N", value_parser = parse_ratio, allow_negative_numbers = true)]
    pub ratio: NonZeroUsize,
    /// Methods to compare: names with commas between, or all.
    #[arg(long, value_name = "A,B", default_value = "all", value_parser = parse_methods)]
    pub methods: Methods,
    /// What makes the frames, which does not change them, with commas between: auto, cpu, gpu or
    /// gpu:NAME.
    #[arg(long, alias = "backend", value_name = "A,B", value_delimiter = ',')]
    #[arg(default_value = "cpu")]
    pub backends: Vec<BackendChoice>,
    /// Threads of the engine [default: as many as there are processors]
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub threads: Option<NonZeroUsize>,
    /// Tell methods that know cameras the capture's own pose at the time of each frame: what a
    /// client that sends late cameras gets. Their rows say so.
    #[arg(long)]
    pub late_camera: bool,
    /// Blur in in-between frames, made up for in their keys: off, on, or auto, as far as no flicker
    /// is seen.
    #[arg(long, default_value_t = FinishMode::Off)]
    pub finish: FinishMode,
    /// With --finish, blur all of an in-between frame, not only where its motion is not to be
    /// relied on; sharper where things move.
    #[arg(long, requires = "finish")]
    pub finish_whole: bool,
    /// Compare what an eye that follows the motion sees, too: of the frames, of the keys alone, and
    /// of the true frames.
    #[arg(long)]
    pub retina: bool,
    /// Display that frames are finished for: a built-in profile (see `perception displays`) or a
    /// file that ends in .toml. It wins over the one that the application named [default: that one]
    #[arg(long, value_name = "NAME")]
    pub profile: Option<String>,
    /// Folder of display profiles, files that end in .toml, that a capture may name beside the
    /// built-in ones.
    #[arg(long, value_name = "DIR")]
    pub profiles: Option<PathBuf>,
    /// Refresh rate that `--finish auto` is for, 1 to 1000.
    #[arg(long, value_name = "HZ", default_value_t = 120.0, value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    pub refresh: f64,
    /// Chart of speed against accuracy, FILE.svg or FILE.png; may be given for each.
    #[arg(long, value_name = "FILE", value_parser = plot::parse_plot)]
    pub chart: Vec<PathBuf>,
    /// Page with everything: chart, tables, error over time, pictures and rung maps to flip through.
    #[arg(long, value_name = "OUT.html")]
    pub report: Option<PathBuf>,
}

/// Methods, each once.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Methods(pub Vec<Method>);

/// Scores each capture and prints a table, or JSON.
///
/// # Errors
/// If a capture cannot be read.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let said = DisplayOptions::read(args.profile.as_deref(), args.profiles.as_deref())?;
    let refresh_interval = MonoSpan::from_hz(args.refresh);
    let mut options = ScoreOptions {
        retina: args.retina,
        finish: FinishConfig::default(),
        methods: args.methods.0.clone(),
        ratio: args.ratio,
        backends: args
            .backends
            .iter()
            .map(|choice| gpu::open(choice).with_context(|| format!("--backends {choice}")))
            .collect::<anyhow::Result<_>>()?,
        threads: args.threads.unwrap_or_else(all_processors),
        timer: clock::now,
        late_camera: args.late_camera,
        kept_frames: match args.report {
            Some(_) => {
                let rows = args.methods.0.len() * args.backends.len();
                frames_to_keep(args.captures.len(), rows)
            }
            None => 0,
        },
    };
    let mut recordings = Vec::new();
    for path in &args.captures {
        let recording = CaptureRecording::open(path)?;
        for warning in recording.warnings()? {
            eprintln!("foreframe: {}: {warning}", path.display());
        }
        recordings.push((path, recording));
    }
    let keys = |frames: usize| frames.div_ceil(args.ratio.get()) as u64;
    let steps = recordings.iter().map(|(_, recording)| keys(recording.heads().len())).sum();
    let progress = output.progress("scoring", steps);
    let mut scores = Vec::new();
    for (path, recording) in &mut recordings {
        let name = recording.name().to_owned();
        progress.set_message(format!("scoring {name}"));
        if args.finish != FinishMode::Off {
            let display = said.of(recording).with_context(|| path.display().to_string())?;
            let profile = display.profile.as_ref();
            options.finish =
                FinishConfig::new(args.finish, profile, refresh_interval).whole(args.finish_whole);
        }
        let score = score_recording(&name, recording, &options, || progress.inc(1))
            .with_context(|| format!("scoring {}", path.display()))?;
        scores.push(score);
    }
    progress.finish_and_clear();
    let report = Report::new(options.threads.get(), scores);
    let mut text = report.to_text();
    for path in &args.chart {
        plot::write(&chart(&report)?, path)?;
        text += &format!("\nthe chart is in {}\n", path.display());
    }
    if let Some(path) = &args.report {
        fs::write(path, page(&report)?).with_context(|| format!("writing {}", path.display()))?;
        text += &format!("\nthe page is in {}\n", path.display());
    }
    output.result(&report, &text)
}

/// What reports call the backend.
pub(crate) fn backend_name(gpu: Option<&Arc<Gpu>>) -> String {
    gpu.map_or_else(|| "cpu".to_owned(), |gpu| format!("gpu:{}", gpu.name()))
}

/// As many threads as there are processors, one where the system does not say.
pub(crate) fn all_processors() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// Methods by name, each once, in the order of the list; `all` for every one.
pub(crate) fn parse_methods(list: &str) -> Result<Methods, String> {
    if list == "all" {
        return Ok(Methods(Method::ALL.to_vec()));
    }
    let mut methods = Vec::new();
    for name in list.split(',') {
        let method = name.trim().parse().map_err(|error| format!("{error}"))?;
        if !methods.contains(&method) {
            methods.push(method);
        }
    }
    Ok(Methods(methods))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_are_taken_once_each_in_the_order_given() {
        let methods = parse_methods("linear, hold,linear").unwrap();
        assert_eq!(methods.0, [Method::Linear, Method::Hold]);
        assert_eq!(parse_methods("all").unwrap().0, Method::ALL);
    }

    #[test]
    fn an_unknown_method_says_which_there_are() {
        let error = parse_methods("hold,voxels").unwrap_err();
        assert!(error.contains("hold, blend") && error.contains("`voxels`"), "{error}");
    }
}
