//! `foreframe demo`.

use std::path::PathBuf;

use anyhow::ensure;
use foreframe_engine::Method;
use foreframe_fixtures::{SceneInfo, Size};
use foreframed::config::SinkSpec;

use crate::demo::{self, Settings};
use crate::output::Output;

/// Arguments of `foreframe demo`.
#[derive(clap::Args, Debug)]
#[command(after_help = "\
Leaves contact-sheet.png (key, in-between, truth, error), timeline.png (when keys came and what was
shown) and summary.json in the folder. Needs about 2 GB of memory at 1280x720 for 3 seconds.")]
pub struct Args {
    /// Scene to show; `foreframe scenes` lists them
    #[arg(long, value_name = "NAME", default_value = "atrium")]
    pub scene: String,
    /// Length of the show in seconds, 0.5 to 10
    #[arg(long, value_name = "S", default_value_t = 3.0)]
    pub seconds: f64,
    /// Columns and rows of a frame
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub size: Size,
    /// Keys per second, 10 to 240
    #[arg(long, value_name = "HZ", default_value_t = 40.0)]
    pub key_rate: f64,
    /// Refreshes per second, 10 to 480
    #[arg(long, value_name = "HZ", default_value_t = 120.0)]
    pub refresh: f64,
    /// How in-between frames are made
    #[arg(long, value_name = "NAME", default_value_t = Method::Linear)]
    pub method: Method,
    /// Where the daemon sends frames besides: shm (the demo alone), png:DIR or y4m:PATH
    #[arg(long, default_value_t = SinkSpec::Shm)]
    pub sink: SinkSpec,
    /// Folder for the pictures and the numbers
    #[arg(long, value_name = "DIR", default_value = "foreframe-demo")]
    pub out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// If an option is out of range, the daemon does not start, or a file cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    in_range("--seconds", args.seconds, 0.5, 10.0)?;
    in_range("--key-rate", args.key_rate, 10.0, 240.0)?;
    in_range("--refresh", args.refresh, 10.0, 480.0)?;
    ensure!(
        !matches!(args.sink, SinkSpec::Null | SinkSpec::Y4mStdout),
        "--sink: expected shm, png:DIR or y4m:PATH, found `{}`; the demo has to see the frames",
        args.sink
    );
    let settings = Settings {
        scene: SceneInfo::by_name(&args.scene)?,
        size: args.size,
        seconds: args.seconds,
        key_rate_hz: args.key_rate,
        refresh_hz: args.refresh,
        method: args.method,
        sink: args.sink.to_string(),
        out: args.out.clone(),
    };
    let summary = demo::run(&settings, output)?;
    output.result(&summary, &summary.text())
}

fn in_range(option: &str, value: f64, least: f64, most: f64) -> anyhow::Result<()> {
    ensure!((least..=most).contains(&value), "{option}: expected {least} to {most}, found {value}");
    Ok(())
}

fn parse_size(text: &str) -> Result<Size, String> {
    let fail = || format!("expected WIDTHxHEIGHT, each 16 to {}, found `{text}`", Size::MAX);
    let (width, height) = text.split_once('x').ok_or_else(fail)?;
    let side = |side: &str| {
        side.parse().ok().filter(|side| (16..=Size::MAX).contains(side)).ok_or_else(fail)
    };
    Ok(Size::new(side(width)?, side(height)?))
}
