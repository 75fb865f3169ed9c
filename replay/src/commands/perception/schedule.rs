//! `foreframe perception schedule`: refresh rate against resolution, Denes 2020, equation 8.20.

use std::path::PathBuf;

use foreframe_fixtures::Size;
use foreframe_perception::motion_quality::Motion;
use foreframe_perception::motion_quality::schedule::{ScheduleDisplay, ScheduleTable, schedule};
use serde::Serialize;

use super::{MotionName, plot, round};
use crate::commands::scenes::parse_size;
use crate::options::number;
use crate::output::Output;
use crate::pictures::{ChartLabels, Series, line_chart};

/// Velocities of the table and of the plot, deg/s: to where tracking ends (Didyk et al. 2010).
const MOST_VELOCITY: u16 = 80;
/// Budgets that are plotted beside the one that is asked for: those of experiment 8.4 and the one
/// of section 8.4, megapixels per second.
const PLOTTED_MPPS: [f64; 4] = [28.0, 55.0, 221.0, 443.0];

#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// Megapixels that can be rendered per second, 0.1 to 100000.
    #[arg(long, value_name = "MP/S", value_parser = number(0.1, 100_000.0))]
    #[arg(allow_negative_numbers = true)]
    budget_mpps: f64,
    /// Velocity of the object that the eye follows, in degrees per second, 0 to 200.
    #[arg(long, value_name = "V", value_parser = number(0.0, 200.0))]
    #[arg(allow_negative_numbers = true)]
    velocity: f64,
    /// Whether the eye knows where the object goes next.
    #[arg(long, value_enum, default_value_t = MotionName::Predictable)]
    motion: MotionName,
    /// Columns and rows of the display.
    #[arg(long, value_name = "WxH", default_value = "2560x1440", value_parser = parse_size)]
    display: Size,
    /// Its horizontal field of view in degrees, 1 to 179.
    #[arg(long, value_name = "DEG", default_value_t = 30.0, value_parser = number(1.0, 179.0))]
    #[arg(allow_negative_numbers = true)]
    fov: f64,
    /// Its highest refresh rate, 50 to 1000.
    #[arg(long, value_name = "HZ", default_value_t = 165.0, value_parser = number(50.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    max_refresh: f64,
    /// Share of a frame during which it is lit, 0.01 to 1.
    #[arg(long, value_name = "P", default_value_t = 1.0, value_parser = number(0.01, 1.0))]
    #[arg(allow_negative_numbers = true)]
    persistence: f64,
    /// Print the look-up table for all whole velocities of 0 to 80 as well.
    #[arg(long)]
    table: bool,
    /// Plot refresh rate over velocity to this SVG or PNG.
    #[arg(long, value_name = "FILE", value_parser = plot::parse_plot)]
    plot: Option<PathBuf>,
}

/// Scripts read these names.
#[derive(Serialize, Debug)]
struct Report {
    refresh_hz: f64,
    scale: f64,
    width: u32,
    height: u32,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    table: Vec<Entry>,
}

#[derive(Serialize, Debug)]
struct Entry {
    velocity: u16,
    refresh_hz: f64,
    scale: f64,
}

pub(super) fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let motion = Motion::from(args.motion);
    let display = ScheduleDisplay {
        size_px: [args.display.width, args.display.height],
        width_deg: args.fov,
        max_refresh_hz: args.max_refresh,
        persistence: args.persistence,
    };
    let budget = args.budget_mpps * 1e6;
    let found = schedule(&display, budget, args.velocity, motion)?;
    let mut table = Vec::new();
    if args.table {
        let entries = ScheduleTable::new(display, budget, motion, MOST_VELOCITY)?;
        table.extend((0..=MOST_VELOCITY).map(|velocity| {
            let at = entries.at(velocity.into());
            Entry { velocity, refresh_hz: round(at.refresh_hz), scale: round(at.scale) }
        }));
    }
    if let Some(path) = &args.plot {
        plot::write(&draw(display, args.budget_mpps, motion)?, path)?;
    }
    let side = |side: u32| (f64::from(side) * found.scale).floor().max(1.0) as u32;
    let report = Report {
        refresh_hz: round(found.refresh_hz),
        scale: round(found.scale),
        width: side(args.display.width),
        height: side(args.display.height),
        table,
    };
    let mut text = format!(
        "{:.1} Hz at {}x{} ({:.0} % of each side)",
        found.refresh_hz,
        report.width,
        report.height,
        found.scale * 100.0
    );
    for Entry { velocity, refresh_hz, scale } in &report.table {
        text += &format!("\n{velocity:3} deg/s  {refresh_hz:6.1} Hz  {:5.1} %", scale * 100.0);
    }
    output.result(&report, &text)
}

fn draw(
    display: ScheduleDisplay,
    budget_mpps: f64,
    motion: Motion,
) -> anyhow::Result<crate::draw::Drawing> {
    let mut budgets = PLOTTED_MPPS.to_vec();
    if !budgets.contains(&budget_mpps) {
        budgets.push(budget_mpps);
    }
    let rates = |budget: f64| -> anyhow::Result<Series> {
        let table = ScheduleTable::new(display, budget * 1e6, motion, MOST_VELOCITY)?;
        // Standing still is a choice between equals.
        let at = |velocity: u16| [velocity.into(), table.at(velocity.into()).refresh_hz];
        Ok(Series { name: format!("{budget} MP/s"), points: (1..=MOST_VELOCITY).map(at).collect() })
    };
    let series = budgets.into_iter().map(rates).collect::<anyhow::Result<Vec<_>>>()?;
    let title = match motion {
        Motion::Predictable => "Best refresh rate, predictable motion",
        Motion::Unpredictable => "Best refresh rate, unpredictable motion",
    };
    let labels = ChartLabels { title, across: "velocity, deg/s", up: "refresh rate, Hz" };
    Ok(line_chart(labels, &series)?)
}
