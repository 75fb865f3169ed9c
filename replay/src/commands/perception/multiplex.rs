//! `foreframe perception multiplex`: table 5.1 of Denes 2020, computed.

use std::path::PathBuf;

use foreframe_perception::multiplex::Technique;
use foreframe_perception::multiplex::table::{Conditions, Row, line_on_retina, row};
use serde::Serialize;

use super::{plot, round};
use crate::options::{number, whole};
use crate::output::Output;
use crate::pictures::{ChartLabels, Series, line_chart};

#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// Refresh rate of the display, 1 to 1000.
    #[arg(long, value_name = "HZ", default_value_t = Conditions::DEFAULT.refresh_hz)]
    #[arg(value_parser = number(1.0, 1000.0), allow_negative_numbers = true)]
    refresh: f64,
    /// Pixels per degree, 1 to 1000.
    #[arg(long, value_name = "PPD", default_value_t = Conditions::DEFAULT.ppd)]
    #[arg(value_parser = number(1.0, 1000.0), allow_negative_numbers = true)]
    ppd: f64,
    /// Luminance of white in cd/m2, 1 to 10000.
    #[arg(long, value_name = "L", default_value_t = Conditions::DEFAULT.peak)]
    #[arg(value_parser = number(1.0, 10_000.0), allow_negative_numbers = true)]
    peak: f64,
    /// Motion of the line in pixels per frame of the display, 0 to 12.
    #[arg(long, value_name = "PX", default_value_t = Conditions::DEFAULT.motion_px.into())]
    #[arg(value_parser = whole(0, 12), allow_negative_numbers = true)]
    motion_px: i32,
    /// Sides of reduced frames over those of full ones, 0.05 to 1.
    #[arg(long, value_name = "R", default_value_t = 0.5, value_parser = number(0.05, 1.0))]
    #[arg(allow_negative_numbers = true)]
    reduction: f64,
    /// Plot the line on the retina, by technique, to this SVG or PNG.
    #[arg(long, value_name = "FILE", value_parser = plot::parse_plot)]
    plot: Option<PathBuf>,
}

/// Scripts read these names.
#[derive(Serialize, Debug)]
struct Report {
    techniques: Vec<Line>,
}

#[derive(Serialize, Debug)]
struct Line {
    technique: &'static str,
    peak_luminance: f64,
    blur_px: f64,
    flicker: f64,
    pixels_saved: f64,
}

impl From<Row> for Line {
    fn from(row: Row) -> Self {
        Self {
            technique: row.technique.name(),
            peak_luminance: round(row.peak_luminance),
            blur_px: round(row.blur_px),
            flicker: round(row.flicker),
            pixels_saved: round(row.pixels_saved),
        }
    }
}

pub(super) fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let at = Conditions {
        refresh_hz: args.refresh,
        ppd: args.ppd,
        peak: args.peak,
        motion_px: u8::try_from(args.motion_px)?,
        ..Conditions::DEFAULT
    };
    let techniques = Technique::ALL.map(|technique| match technique {
        Technique::Multiplexing(_) => Technique::Multiplexing(args.reduction),
        other => other,
    });
    let rows = techniques.iter().map(|technique| Ok(Line::from(row(*technique, &at)?)));
    let report = Report { techniques: rows.collect::<anyhow::Result<_>>()? };
    if let Some(path) = &args.plot {
        let mut series = Vec::new();
        for technique in techniques {
            let columns = line_on_retina(technique, &at)?;
            let points = (0..).zip(columns).map(|(x, light)| [f64::from(x), light]).collect();
            series.push(Series { name: technique.name().to_owned(), points });
        }
        let title = format!("A line that moves by {} px a frame, on the retina", at.motion_px);
        let labels = ChartLabels { title: &title, across: "position, px", up: "light" };
        plot::write(&line_chart(labels, &series)?, path)?;
    }
    let mut text =
        format!("{:14} {:>10} {:>8} {:>8} {:>8}\n", "", "luminance", "blur px", "flicker", "saved");
    for line in &report.techniques {
        text += &format!(
            "{:14} {:>8.0} % {:>8.1} {:>8.3} {:>6.1} %\n",
            line.technique,
            line.peak_luminance * 100.0,
            line.blur_px,
            line.flicker,
            line.pixels_saved * 100.0
        );
    }
    text += "\nluminance: of white. blur: width of a moving line on the retina. flicker: highest \
             probability that it is seen on a still picture. saved: pixels that are not rendered.";
    output.result(&report, &text)
}
