//! `foreframe perception window`: the spectrum of a moving line, Denes 2020, figure 5.6.

use std::path::PathBuf;

use foreframe_perception::multiplex::Technique;
use foreframe_perception::sensitivity::PyramidOfVisibility;
use foreframe_perception::window::{LineSpectrum, Window};
use serde::Serialize;

use super::{plot, round};
use crate::draw::Drawing;
use crate::options::number;
use crate::output::Output;
use crate::pictures::{ChartLabels, MapAxes, map_chart};

/// Half the height of a line of the spectrum in the plot, Hz: lines have none of their own.
const LINE_HZ: f64 = 2.0;

#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// full, reprojection, half-rate, interlace, bfi, ncsfi or trm.
    #[arg(long, default_value = "full", value_parser = parse_technique)]
    technique: Technique,
    /// Refresh rate of the display, 1 to 1000.
    #[arg(long, value_name = "HZ", default_value_t = 120.0, value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    refresh: f64,
    /// Pixels per degree, 1 to 1000.
    #[arg(long, value_name = "PPD", default_value_t = 56.0, value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    ppd: f64,
    /// Velocity of the line in degrees per second, 0 to 200.
    #[arg(long, value_name = "V", default_value_t = 20.0, value_parser = number(0.0, 200.0))]
    #[arg(allow_negative_numbers = true)]
    velocity: f64,
    /// Share of a frame during which the display is lit, 0.01 to 1.
    #[arg(long, value_name = "P", default_value_t = 1.0, value_parser = number(0.01, 1.0))]
    #[arg(allow_negative_numbers = true)]
    persistence: f64,
    /// Luminance that the eye is adapted to, cd/m2, 0.1 to 10000.
    #[arg(long, value_name = "L", default_value_t = 100.0, value_parser = number(0.1, 10_000.0))]
    #[arg(allow_negative_numbers = true)]
    luminance: f64,
    /// Plot the spectrum and the window to this SVG or PNG.
    #[arg(long, value_name = "FILE", value_parser = plot::parse_plot)]
    plot: Option<PathBuf>,
}

fn parse_technique(name: &str) -> Result<Technique, String> {
    let known = Technique::ALL;
    let names: Vec<_> = known.iter().map(|technique| technique.name()).collect();
    let found = known.into_iter().find(|technique| technique.name() == name);
    found.ok_or_else(|| format!("expected one of {}, found `{name}`", names.join(", ")))
}

/// Scripts read these names.
#[derive(Serialize, Debug)]
struct Report {
    technique: &'static str,
    /// None if the line stays sharp beyond the window.
    half_amplitude_cpd: Option<f64>,
    visible_copies: f64,
    window_hz: f64,
    window_cpd: f64,
}

pub(super) fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let Args { technique, refresh, ppd, velocity, persistence, luminance, .. } = *args;
    let spectrum = LineSpectrum::new(technique, refresh, ppd, velocity, persistence)?;
    let window = Window::new(&PyramidOfVisibility::ROBSON, luminance)?;
    let report = Report {
        technique: technique.name(),
        half_amplitude_cpd: spectrum.half_amplitude_cpd(window.cpd).map(round),
        visible_copies: round(spectrum.visible_copies(&window)),
        window_hz: round(window.hz),
        window_cpd: round(window.cpd),
    };
    if let Some(path) = &args.plot {
        plot::write(&draw(args, &spectrum, &window), path)?;
    }
    let sharpness = report.half_amplitude_cpd.map_or_else(
        || "sharp as far as can be seen".to_owned(),
        |cpd| format!("half of the contrast is left at {cpd:.1} cpd"),
    );
    let text = format!(
        "{}: {sharpness}; contrast of the most visible copy {:.4} of the highest sensitivity\n\
         the window reaches to {:.0} Hz and {:.0} cpd",
        report.technique, report.visible_copies, window.hz, window.cpd
    );
    output.result(&report, &text)
}

fn draw(args: &Args, spectrum: &LineSpectrum, window: &Window) -> Drawing {
    let (cpd, hz) = (window.cpd, window.hz);
    let axes = MapAxes { across: [-cpd, cpd], up: [-2.0 * hz, 2.0 * hz], cells: [169, 133] };
    let full = spectrum.amplitude(0, 0.0);
    let value = |at_cpd: f64, at_hz: f64| {
        let nearest = (at_hz / spectrum.harmonic_hz(1)).round() as i32;
        let is_on_line = (at_hz - spectrum.harmonic_hz(nearest)).abs() <= LINE_HZ;
        if is_on_line { spectrum.amplitude(nearest, at_cpd) / full } else { 0.0 }
    };
    let diamond = [[0.0, hz], [cpd, 0.0], [0.0, -hz], [-cpd, 0.0], [0.0, hz]];
    let title = format!(
        "A line at {} deg/s on a {} Hz display, {}",
        args.velocity,
        args.refresh,
        args.technique.name()
    );
    let labels = ChartLabels {
        title: &title,
        across: "spatial frequency, cpd",
        up: "temporal frequency, Hz",
    };
    map_chart(labels, &axes, value, &diamond)
}
