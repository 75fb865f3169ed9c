//! `foreframe import`.

use std::path::PathBuf;

use clap::ValueEnum;
use foreframed::capture::Coding;
use serde::Serialize;

use crate::exr_frames::import::{self, Options};
use crate::output::Output;

/// How planes are stored.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum CodingName {
    /// As they are.
    Raw,
    /// LZ4.
    Fast,
    /// Filtered, then zstd: the smallest file.
    Small,
}

impl CodingName {
    fn coding(self) -> Coding {
        match self {
            Self::Raw => Coding::RAW,
            Self::Fast => Coding::FAST,
            Self::Small => Coding::SMALL,
        }
    }
}

/// Arguments of `foreframe import`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Folder of EXR frames with `frame_NNNN.json` side-cars.
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Capture to write.
    #[arg(short, long, value_name = "FILE.mcap")]
    pub output: PathBuf,
    /// Name of the capture, instead of that in the side-cars.
    #[arg(long)]
    pub name: Option<String>,
    /// How planes are stored.
    #[arg(long, value_enum, default_value = "small")]
    pub coding: CodingName,
}

#[derive(Serialize)]
struct Report {
    frames: u64,
    depths: u64,
    motions: u64,
    raw_bytes: u64,
    stored_bytes: u64,
}

/// Runs the command.
///
/// # Errors
/// If a file is missing or does not hold what it must; nothing is written then.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let bar = output.progress("importing", 0);
    let options = Options { name: args.name.clone(), coding: args.coding.coding() };
    let imported = import::import(&args.folder, &args.output, &options, |done, all| {
        bar.set_length(all);
        bar.set_position(done);
    })?;
    bar.finish_and_clear();
    let report = Report {
        frames: imported.frames,
        depths: imported.depths,
        motions: imported.motions,
        raw_bytes: imported.raw_bytes,
        stored_bytes: imported.stored_bytes,
    };
    let text = format!(
        "{} frames, {} depth and {} motion planes, {:.1} MB of pixels in {:.1} MB: {}",
        report.frames,
        report.depths,
        report.motions,
        report.raw_bytes as f64 / 1e6,
        report.stored_bytes as f64 / 1e6,
        args.output.display()
    );
    output.result(&report, &text)
}
