//! `foreframe perception quality`: motion quality after Denes 2020, chapter 8.

use std::path::PathBuf;

use foreframe_perception::motion_quality::{Motion, Shown, quality_difference};
use serde::Serialize;

use super::{MotionName, plot, round};
use crate::options::number;
use crate::output::Output;
use crate::pictures::{ChartLabels, Series, line_chart};

#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// Refresh rate to judge, 1 to 1000.
    #[arg(long, value_name = "HZ", value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    refresh: f64,
    /// Its resolution in pixels per degree, 1 to 1000.
    #[arg(long, value_name = "PPD", value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    ppd: f64,
    /// Share of a frame during which the display is lit, 0.01 to 1.
    #[arg(long, value_name = "P", default_value_t = 1.0, value_parser = number(0.01, 1.0))]
    #[arg(allow_negative_numbers = true)]
    persistence: f64,
    /// Refresh rate to compare with, 1 to 1000.
    #[arg(long, value_name = "HZ", value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    than_refresh: f64,
    /// Resolution to compare with, 1 to 1000; without it, the same.
    #[arg(long, value_name = "PPD", value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    than_ppd: Option<f64>,
    /// Persistence to compare with, 0.01 to 1.
    #[arg(long, value_name = "P", default_value_t = 1.0, value_parser = number(0.01, 1.0))]
    #[arg(allow_negative_numbers = true)]
    than_persistence: f64,
    /// Velocity of the object that the eye follows, in degrees per second, 0 to 200.
    #[arg(long, value_name = "V", value_parser = number(0.0, 200.0))]
    #[arg(allow_negative_numbers = true)]
    velocity: f64,
    /// Whether the eye knows where the object goes next.
    #[arg(long, value_enum, default_value_t = MotionName::Predictable)]
    motion: MotionName,
    /// Plot quality over refresh rate to this SVG or PNG.
    #[arg(long, value_name = "FILE", value_parser = plot::parse_plot)]
    plot: Option<PathBuf>,
}

/// Scripts read these names.
#[derive(Serialize, Debug)]
struct Report {
    delta_jnd: f64,
    parallel_blur_jnd: f64,
    orthogonal_blur_jnd: f64,
    judder_jnd: f64,
}

pub(super) fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let motion = Motion::from(args.motion);
    let this = Shown { refresh_hz: args.refresh, ppd: args.ppd, persistence: args.persistence };
    let that = Shown {
        refresh_hz: args.than_refresh,
        ppd: args.than_ppd.unwrap_or(args.ppd),
        persistence: args.than_persistence,
    };
    let found = quality_difference(this, that, args.velocity, motion);
    if let Some(path) = &args.plot {
        plot::write(&draw(this, that, args.velocity, motion)?, path)?;
    }
    let report = Report {
        delta_jnd: round(found.total()),
        parallel_blur_jnd: round(found.parallel),
        orthogonal_blur_jnd: round(found.orthogonal),
        judder_jnd: round(found.judder),
    };
    let text = format!(
        "{:+.2} JND (+1: three viewers of four prefer the first)\n\
         blur along the motion {:+.2}, across it {:+.2}, judder {:+.2}",
        found.total(),
        found.parallel,
        found.orthogonal,
        found.judder
    );
    output.result(&report, &text)
}

fn draw(
    this: Shown,
    that: Shown,
    velocity: f64,
    motion: Motion,
) -> anyhow::Result<crate::draw::Drawing> {
    let mut velocities = vec![15.0, 30.0, 45.0];
    if !velocities.contains(&velocity) {
        velocities.push(velocity);
    }
    let most = this.refresh_hz.max(that.refresh_hz).max(165.0) as u32;
    let quality = |velocity: f64| Series {
        name: format!("{velocity} deg/s"),
        points: (50..=most)
            .map(|rate| {
                let shown = Shown { refresh_hz: rate.into(), ..this };
                [rate.into(), quality_difference(shown, that, velocity, motion).total()]
            })
            .collect(),
    };
    let series: Vec<_> = velocities.into_iter().map(quality).collect();
    let title = format!(
        "Motion quality against {} Hz, {:.0} ppd, {}",
        that.refresh_hz,
        that.ppd,
        match motion {
            Motion::Predictable => "predictable motion",
            Motion::Unpredictable => "unpredictable motion",
        }
    );
    let labels = ChartLabels { title: &title, across: "refresh rate, Hz", up: "quality, JND" };
    Ok(line_chart(labels, &series)?)
}
