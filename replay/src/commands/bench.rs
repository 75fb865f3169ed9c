//! `foreframe bench`: how fast the engine is here, beside plain copies of the same bytes.

use std::num::NonZeroUsize;

use foreframe_fixtures::{SceneInfo, Size};

use super::scenes::parse_size;
use super::score::{Methods, all_processors, parse_methods};
use crate::bench::{self, Settings};
use crate::options::{number, parse_count, parse_scene};
use crate::output::Output;

/// Arguments of `foreframe bench`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Scenes, with commas between; `foreframe scenes` lists them
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = parse_scene)]
    #[arg(default_value = "atrium,pan,static")]
    pub scenes: Vec<&'static SceneInfo>,
    /// Sizes of colour, with commas between
    #[arg(long, value_name = "WxH", value_delimiter = ',', value_parser = parse_size)]
    #[arg(default_value = "1280x720,1920x1080")]
    pub sizes: Vec<Size>,
    /// Methods to time: names with commas between, or all
    #[arg(long, value_name = "A,B", default_value = "linear", value_parser = parse_methods)]
    pub methods: Methods,
    /// Threads of the engine and of the plain copy [default: as many as there are processors]
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub threads: Option<NonZeroUsize>,
    /// Keys to time in each case; medians over them are shown
    #[arg(long, value_name = "N", default_value = "40")]
    #[arg(value_parser = parse_count, allow_negative_numbers = true)]
    pub keys: NonZeroUsize,
    /// In-between frames after each key, evenly spaced
    #[arg(long, value_name = "N", default_value = "2")]
    #[arg(value_parser = parse_count, allow_negative_numbers = true)]
    pub frames: NonZeroUsize,
    /// Colour is this much larger per axis than depth and motion, 1 to 4
    #[arg(long, value_name = "R", default_value_t = 2.0, value_parser = number(1.0, 4.0))]
    #[arg(allow_negative_numbers = true)]
    pub field_ratio: f64,
}

/// Times every case and prints a table, or JSON.
///
/// # Errors
/// If the system gives no threads, or the engine refuses its keys.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let settings = Settings {
        scenes: args.scenes.clone(),
        sizes: args.sizes.clone(),
        methods: args.methods.0.clone(),
        threads: args.threads.unwrap_or_else(all_processors),
        keys: args.keys,
        frames: args.frames,
        field_ratio: args.field_ratio,
    };
    let report = bench::run(&settings, output)?;
    output.result(&report, &report.to_text())
}
