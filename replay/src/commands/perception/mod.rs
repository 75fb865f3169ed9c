//! `foreframe perception`: ask the models of display and eye, one sub-command per model.
//!
//! Each reads its numbers, calls `foreframe-perception`, and reports; plots are drawn once and
//! written as SVG or PNG by the name of the file.

mod banding;
mod displays;
mod flicker;
mod multiplex;
mod quality;
mod retina;
mod schedule;
mod window;

use anyhow::Context as _;
use foreframe_perception::motion_quality::Motion;
use foreframed::config::read_profile;
use image::RgbImage;

use super::plot;
use crate::output::Output;

/// Arguments of `foreframe perception`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Which model to ask.
    #[command(subcommand)]
    model: Model,
}

#[derive(clap::Subcommand, Debug)]
enum Model {
    /// How much better motion looks at one refresh rate and resolution than at another.
    Quality(quality::Args),
    /// The best refresh rate and resolution for a budget of pixels per second.
    Schedule(schedule::Args),
    /// Whether two alternating frames are seen to flicker.
    Flicker(flicker::Args),
    /// Whether the steps of a gradient are seen, and how many bits hide them.
    Banding(banding::Args),
    /// What an eye that follows motion collects of a sequence of frames.
    Retina(retina::Args),
    /// Ways to show motion with half of the rendering, compared.
    Multiplex(multiplex::Args),
    /// The spectrum of a moving line, and what of it is inside the window of visibility.
    Window(window::Args),
    /// List the built-in display profiles.
    Displays,
}

/// Runs the command.
///
/// # Errors
/// If a file cannot be read or written, or a number is outside of a model's domain.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    match &args.model {
        Model::Quality(args) => quality::run(args, output),
        Model::Schedule(args) => schedule::run(args, output),
        Model::Flicker(args) => flicker::run(args, output),
        Model::Banding(args) => banding::run(args, output),
        Model::Retina(args) => retina::run(args, output),
        Model::Multiplex(args) => multiplex::run(args, output),
        Model::Window(args) => window::run(args, output),
        Model::Displays => displays::run(output),
    }
}

/// `predictable` or `unpredictable`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
enum MotionName {
    /// The eye knows where the object goes next.
    Predictable,
    /// It does not.
    Unpredictable,
}

impl From<MotionName> for Motion {
    fn from(name: MotionName) -> Self {
        match name {
            MotionName::Predictable => Self::Predictable,
            MotionName::Unpredictable => Self::Unpredictable,
        }
    }
}

/// The picture in a PNG, alpha left out.
fn read_png(path: &std::path::Path) -> anyhow::Result<RgbImage> {
    let image = image::open(path).with_context(|| format!("reading {}", path.display()))?;
    Ok(image.into_rgb8())
}

/// Rounded for people and scripts: no model is good to more digits.
fn round(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests;
