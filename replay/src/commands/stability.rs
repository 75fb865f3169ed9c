//! `foreframe stability`: where methods fail.

use std::fs;
use std::path::PathBuf;

use anyhow::Context as _;
use foreframe_engine::Method;
use foreframe_fixtures::probes::PICTURE;

use super::plot;
use super::score::{Methods, parse_methods};
use crate::output::Output;
use crate::stability::page::page;
use crate::stability::plot::plot as sweeps_chart;
use crate::stability::report::Report;
use crate::stability::run::run_sweep;
use crate::stability::sweeps::{SWEEPS, Sweep};

/// Arguments of `foreframe stability`.
#[derive(clap::Args, Debug)]
#[command(after_help = "\
Each sweep turns one knob on a small scene that isolates one difficulty, renders keys and truths, and
lets every method make the frames between. `hold` always takes part: the others are read against it.

Examples:
  foreframe stability
  foreframe stability --sweeps speed,thin-bars --methods linear,grid
  foreframe stability --chart stability.svg --json")]
pub struct Args {
    /// Sweeps to run: names with commas between, or all
    #[arg(long, value_name = "A,B", default_value = "all", value_parser = parse_sweeps)]
    pub sweeps: Sweeps,
    /// Methods to compare besides hold: names with commas between, or all
    #[arg(long, value_name = "A,B", default_value = "all", value_parser = parse_methods)]
    pub methods: Methods,
    /// One small chart per sweep, FILE.svg or FILE.png; may be given for each
    #[arg(long, value_name = "FILE", value_parser = plot::parse_plot)]
    pub chart: Vec<PathBuf>,
    /// Page with the charts and all tables
    #[arg(long, value_name = "OUT.html")]
    pub report: Option<PathBuf>,
}

/// Sweeps, each once.
#[derive(Clone, Debug)]
pub struct Sweeps(pub Vec<&'static Sweep>);

/// Runs the sweeps and prints tables, or JSON.
///
/// # Errors
/// If an engine refuses a key, or a file cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let mut methods = args.methods.0.clone();
    methods.retain(|method| *method != Method::Hold);
    methods.insert(0, Method::Hold);
    let steps: usize = args.sweeps.0.iter().map(|sweep| (sweep.points)().len()).sum();
    let progress = output.progress("sweeping", steps as u64);
    let mut sweeps = Vec::new();
    for sweep in &args.sweeps.0 {
        progress.set_message(sweep.name);
        sweeps.push(run_sweep(sweep, &methods, || progress.inc(1))?);
    }
    progress.finish_and_clear();
    let report = Report::new(PICTURE.width, PICTURE.height, sweeps);
    let mut text = report.to_text();
    for path in &args.chart {
        plot::write(&sweeps_chart(&report)?, path)?;
        text += &format!("\nthe charts are in {}\n", path.display());
    }
    if let Some(path) = &args.report {
        fs::write(path, page(&report)?).with_context(|| format!("writing {}", path.display()))?;
        text += &format!("\nthe page is in {}\n", path.display());
    }
    output.result(&report, &text)
}

/// Sweeps by name, each once, in the order of the list; `all` for every one.
fn parse_sweeps(list: &str) -> Result<Sweeps, String> {
    if list == "all" {
        return Ok(Sweeps(SWEEPS.iter().collect()));
    }
    let mut sweeps: Vec<&'static Sweep> = Vec::new();
    for name in list.split(',').map(str::trim) {
        let sweep = Sweep::by_name(name).ok_or_else(|| {
            let names: Vec<_> = SWEEPS.iter().map(|sweep| sweep.name).collect();
            format!("expected all or some of {}, found `{name}`", names.join(", "))
        })?;
        if sweeps.iter().all(|other| other.name != sweep.name) {
            sweeps.push(sweep);
        }
    }
    Ok(Sweeps(sweeps))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_are_taken_once_each_in_the_order_given() {
        let sweeps = parse_sweeps("speed, cut,speed").unwrap();
        let names: Vec<_> = sweeps.0.iter().map(|sweep| sweep.name).collect();
        assert_eq!(names, ["speed", "cut"]);
        assert_eq!(parse_sweeps("all").unwrap().0.len(), SWEEPS.len());
    }

    #[test]
    fn an_unknown_sweep_says_which_there_are() {
        let error = parse_sweeps("speed,warp").unwrap_err();
        assert!(error.contains("distance, speed") && error.ends_with("`warp`"), "{error}");
    }
}
