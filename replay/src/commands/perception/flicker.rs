//! `foreframe perception flicker`: whether two alternating frames flicker, Denes 2020, chapter 7.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use foreframe_perception::display::{DisplayProfile, GainOffsetGamma};
use foreframe_perception::flicker::FlickerModel;
use foreframe_perception::plane::Plane;
use image::{Rgb, RgbImage};
use serde::Serialize;

use super::{read_png, read_profile, round};
use crate::draw::palette::heat;
use crate::options::{number, whole};
use crate::output::Output;

#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// The first of two PNG frames.
    first: PathBuf,
    /// The second.
    second: PathBuf,
    /// Refresh rate at which they take turns, 1 to 1000.
    #[arg(long, value_name = "HZ", value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    refresh: f64,
    /// Frames after which the pattern repeats, 2 to 16: a key and its in-between frames.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = whole(2, 16))]
    #[arg(allow_negative_numbers = true)]
    frames: i32,
    /// Pixels per degree, 1 to 1000.
    #[arg(long, value_name = "PPD", value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    ppd: f64,
    /// Display: a built-in profile (see `perception displays`) or a file that ends in .toml.
    #[arg(long, value_name = "NAME", default_value = "asus-pg279q")]
    profile: String,
    /// Write the map of probabilities to this PNG: white 0, yellow, red, black 1.
    #[arg(long, value_name = "FILE.png")]
    map: Option<PathBuf>,
}

/// Scripts read these names.
#[derive(Serialize, Debug)]
struct Report {
    max: f64,
    mean: f64,
    /// Pixels where at least half of the viewers see flicker.
    visible_percent: f64,
}

pub(super) fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let profile = read_profile(&args.profile)?;
    let planes = [luminance(&args.first, &profile)?, luminance(&args.second, &profile)?];
    let frames = u32::try_from(args.frames)?;
    let model = FlickerModel::new(args.refresh, args.ppd)?.repeating_after(frames)?;
    let map = model.map(&planes[0], &planes[1])?;
    if let Some(path) = &args.map {
        write_map(&map, path)?;
    }
    let visible = map.values().iter().filter(|seen| **seen >= 0.5).count();
    let report = Report {
        max: round(map.max().into()),
        mean: round(map.mean()),
        visible_percent: round(visible as f64 / map.values().len() as f64 * 100.0),
    };
    let text = format!(
        "seen with probability {:.2} at most and {:.2} on average; by half of the viewers or more in \
         {:.1} % of the picture",
        report.max, report.mean, report.visible_percent
    );
    output.result(&report, &text)
}

/// Luminance of a picture on the display, cd/m2.
fn luminance(path: &Path, profile: &DisplayProfile) -> anyhow::Result<Plane> {
    let image = read_png(path)?;
    let channels = channel_luminance(profile.model());
    let black = profile.model().black_xyz()[1] as f32;
    let light = |pixel: &Rgb<u8>| {
        let add = |channel: usize| channels[channel][usize::from(pixel.0[channel])];
        black + add(0) + add(1) + add(2)
    };
    let (width, height) = (image.width() as usize, image.height() as usize);
    Plane::new(width, height, image.pixels().map(light).collect())
        .with_context(|| format!("{}: expected a picture with pixels", path.display()))
}

/// Luminance that each level of each channel adds.
fn channel_luminance(model: &GainOffsetGamma) -> [Vec<f32>; 3] {
    let full = model.channel_luminance();
    std::array::from_fn(|channel| {
        let light = |level: u8| {
            let share = model.light([f64::from(level) / 255.0; 3])[channel];
            (share * full[channel]) as f32
        };
        (0..=255).map(light).collect()
    })
}

fn write_map(map: &Plane, path: &Path) -> anyhow::Result<()> {
    let (width, height) = (u32::try_from(map.width())?, u32::try_from(map.height())?);
    let image = RgbImage::from_fn(width, height, |x, y| {
        let seen = map.at(x.cast_signed() as isize, y.cast_signed() as isize);
        Rgb(heat((seen * 255.0).round() as u8))
    });
    image.save(path).with_context(|| format!("writing {}", path.display()))
}
