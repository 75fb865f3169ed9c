//! `foreframe export`.

use std::path::PathBuf;

use anyhow::Context as _;
use foreframed::capture::Capture;
use serde::Serialize;

use crate::exr_frames::export;
use crate::options::parse_whole;
use crate::output::Output;
use crate::recording::capture::warnings;

/// Arguments of `foreframe export`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Capture to read.
    #[arg(value_name = "FILE.mcap")]
    pub file: PathBuf,
    /// Folder to write frames to; made if it is not there.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Which stream of the capture, counted from 0.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_whole::<usize>)]
    #[arg(allow_negative_numbers = true)]
    pub stream: usize,
}

#[derive(Serialize)]
struct Report {
    frames: u64,
}

/// Runs the command.
///
/// # Errors
/// If the capture cannot be read, or the folder has frames in it or cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let named = || args.file.display().to_string();
    let capture = Capture::open(&args.file).with_context(named)?;
    for warning in warnings(&capture.info().with_context(named)?) {
        eprintln!("foreframe: {}: {warning}", named());
    }
    let bar = output.progress("exporting", 0);
    let frames = export::export(&capture, args.stream, &args.output, |done, all| {
        bar.set_length(all);
        bar.set_position(done);
    })
    .with_context(named)?;
    bar.finish_and_clear();
    let text = format!("{frames} frames: {}", args.output.display());
    output.result(&Report { frames }, &text)
}
