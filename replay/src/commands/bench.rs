//! `foreframe bench`: how fast the engine is here, beside plain copies of the same bytes.

use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use foreframe_engine::backend::choice::BackendChoice;
use foreframe_fixtures::{SceneInfo, Size};
use foreframed::gpu;

use super::scenes::parse_size;
use super::score::{Methods, all_processors, backend_name, parse_methods};
use crate::bench::chart::chart;
use crate::bench::report::Report;
use crate::bench::{self, Backend, Settings};
use crate::options::{number, parse_count, parse_scene};
use crate::output::Output;

/// Sizes without `--sizes`.
const SIZES: [Size; 2] = [Size::new(1280, 720), Size::new(1920, 1080)];
/// Sizes without `--sizes` for a chart.
const CHART_SIZES: [Size; 7] = [
    Size::new(256, 144),
    Size::new(512, 288),
    Size::new(1024, 576),
    Size::new(1280, 720),
    Size::new(1920, 1080),
    Size::new(2560, 1440),
    Size::new(3840, 2160),
];
/// Names of the chart's two files.
const CHART_FILES: [&str; 2] = ["bench.svg", "bench.png"];

/// Arguments of `foreframe bench`.
#[derive(clap::Args, Debug)]
#[command(after_help = "\
Beside each time stands that of a plain copy of half the bytes that a key or an in-between has to read
and write, in the same run with the same threads, and `hold`: all of the work where nothing moves.

Examples:
  foreframe bench
  foreframe bench --scenes atrium --sizes 1024x1024 --methods linear,grid
  foreframe bench --backends cpu,gpu:llvmpipe --sizes 1920x1080
  foreframe bench --scenes atrium --chart charts")]
pub struct Args {
    /// Scenes, with commas between; `foreframe scenes` lists them
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = parse_scene)]
    #[arg(default_value = "atrium,pan,static")]
    pub scenes: Vec<&'static SceneInfo>,
    /// Sizes of colour, with commas between [default: 1280x720,1920x1080; for a chart seven from
    /// 256x144 to 3840x2160]
    #[arg(long, value_name = "WxH", value_delimiter = ',', value_parser = parse_size)]
    pub sizes: Vec<Size>,
    /// What makes the frames, with commas between: auto, cpu, gpu or gpu:NAME
    #[arg(long, alias = "backend", value_name = "A,B", value_delimiter = ',')]
    #[arg(default_value = "cpu")]
    pub backends: Vec<BackendChoice>,
    /// Folder for a chart of time against pixels, bench.svg and bench.png; made if it is not there
    #[arg(long, value_name = "DIR")]
    pub chart: Option<PathBuf>,
    /// Methods to time besides hold: names with commas between, or all
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
/// If a backend cannot be had, the system gives no threads, or the chart cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let open = |choice| -> anyhow::Result<Backend> {
        let gpu = gpu::open(choice).with_context(|| format!("--backends {choice}"))?;
        Ok(Backend { name: backend_name(gpu.as_ref()), gpu })
    };
    if let Some(dir) = &args.chart {
        // Before the minutes of timing, not after them.
        fs::create_dir_all(dir).with_context(|| format!("making {}", dir.display()))?;
    }
    let settings = Settings {
        scenes: args.scenes.clone(),
        sizes: args.sizes(),
        backends: args.backends.iter().map(open).collect::<Result<_, _>>()?,
        methods: args.methods.0.clone(),
        threads: args.threads.unwrap_or_else(all_processors),
        keys: args.keys,
        frames: args.frames,
        field_ratio: args.field_ratio,
    };
    let report = bench::run(&settings, output)?;
    let mut text = report.to_text();
    if let Some(dir) = &args.chart {
        write_chart(&report, dir)?;
        let files = CHART_FILES.map(|name| dir.join(name).display().to_string());
        text += &format!("\nthe chart is in {}", files.join(" and "));
    }
    output.result(&report, &text)
}

impl Args {
    fn sizes(&self) -> Vec<Size> {
        match (self.sizes.is_empty(), &self.chart) {
            (false, _) => self.sizes.clone(),
            (true, None) => SIZES.to_vec(),
            (true, Some(_)) => CHART_SIZES.to_vec(),
        }
    }
}

fn write_chart(report: &Report, dir: &Path) -> anyhow::Result<()> {
    let drawing = chart(report).context("expected times to draw, found none")?;
    let [svg, png] = CHART_FILES.map(|name| dir.join(name));
    fs::write(&svg, drawing.to_svg()).with_context(|| format!("writing {}", svg.display()))?;
    let pixmap = drawing.to_pixmap().context("the chart does not fit the memory")?;
    pixmap.save_png(&png).with_context(|| format!("writing {}", png.display()))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::cli::{Cli, Command};

    fn parsed(arguments: &str) -> Args {
        let words = ["foreframe", "bench"].into_iter().chain(arguments.split_whitespace());
        match Cli::try_parse_from(words).unwrap().command {
            Command::Bench(args) => args,
            other => panic!("expected the bench, found {other:?}"),
        }
    }

    #[test]
    fn sizes_are_those_asked_for_or_else_what_a_table_or_a_chart_needs() {
        assert_eq!(parsed("").sizes(), SIZES);
        assert_eq!(parsed("--chart x").sizes(), CHART_SIZES);
        let asked = parsed("--chart x --sizes 32x18,64x36").sizes();
        assert_eq!(asked, [Size::new(32, 18), Size::new(64, 36)]);
    }

    #[test]
    fn backends_are_a_list_and_the_singular_is_understood() {
        let named = |name: &str| BackendChoice::Named(name.to_owned());
        let both = [BackendChoice::Cpu, named("llvmpipe")];
        assert_eq!(parsed("--backends cpu,gpu:llvmpipe").backends, both);
        assert_eq!(parsed("--backend gpu:x").backends, [named("x")]);
        assert_eq!(parsed("").backends, [BackendChoice::Cpu]);
    }

    #[test]
    fn a_chart_is_two_files_of_one_drawing() {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path().join("made").join("here");
        let args = parsed(&format!(
            "--scenes static --sizes 32x18,48x26 --keys 2 --chart {}",
            dir.display()
        ));
        run(&args, &Output::new(true)).unwrap();
        let svg = fs::read_to_string(dir.join("bench.svg")).unwrap();
        assert!(svg.contains("static linear, cpu"), "{svg}");
        let png = image::open(dir.join("bench.png")).unwrap();
        assert!(svg.contains(&format!("width=\"{}\" height=\"{}\"", png.width(), png.height())));
    }
}
