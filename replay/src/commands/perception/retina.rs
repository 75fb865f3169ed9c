//! `foreframe perception retina`: the image on the retina of a sequence of frames.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use foreframe_perception::display::{DisplayProfile, GainOffsetGamma};
use foreframe_perception::plane::Plane;
use foreframe_perception::retina::{FUSION_S, lit_frames, pursuit_blurred, retinal_image};
use image::{Rgb, RgbImage};
use serde::Serialize;

use super::{MotionName, read_png, read_profile, round};
use crate::options::number;
use crate::output::Output;

#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// PNG frames in the order of the display, the first from time 0.
    #[arg(required = true)]
    frames: Vec<PathBuf>,
    /// Refresh rate of the display, 1 to 1000.
    #[arg(long, value_name = "HZ", value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    refresh: f64,
    /// Motion of the gaze in pixels per second, x right and y down, -100000 to 100000 each.
    #[arg(long, value_name = "X,Y", default_value = "0,0", value_parser = parse_velocity)]
    #[arg(allow_negative_numbers = true)]
    velocity: Velocity,
    /// Share of a frame during which the display is lit, 0.01 to 1; without it, the profile's.
    #[arg(long, value_name = "P", value_parser = number(0.01, 1.0))]
    #[arg(allow_negative_numbers = true)]
    persistence: Option<f64>,
    /// When the eye starts to collect light, 0 to 1000000.
    #[arg(long, value_name = "MS", default_value_t = 0.0, value_parser = number(0.0, 1e6))]
    #[arg(allow_negative_numbers = true)]
    start_ms: f64,
    /// For how long it does, 0.1 to 1000.
    #[arg(long, value_name = "MS", default_value_t = FUSION_S * 1e3)]
    #[arg(value_parser = number(0.1, 1000.0), allow_negative_numbers = true)]
    window_ms: f64,
    /// Add the blur of imperfect pursuit of such motion; needs --ppd.
    #[arg(long, value_enum, requires = "ppd")]
    motion: Option<MotionName>,
    /// Pixels per degree, 1 to 1000.
    #[arg(long, value_name = "PPD", value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    ppd: Option<f64>,
    /// Display: a built-in profile (see `perception displays`) or a file that ends in .toml.
    #[arg(long, value_name = "NAME", default_value = "asus-pg279q")]
    profile: String,
    /// PNG to write: codes that would show the collected light on that display.
    #[arg(long, value_name = "FILE.png")]
    out: Option<PathBuf>,
    /// A retinal image to compare with, as PNG.
    #[arg(long, value_name = "FILE.png")]
    reference: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Velocity([f64; 2]);

fn parse_velocity(text: &str) -> Result<Velocity, String> {
    let fail = || format!("expected two numbers of -100000 to 100000 as X,Y, found `{text}`");
    let numbers: Vec<f64> =
        text.split(',').map(str::parse).collect::<Result<_, _>>().map_err(|_| fail())?;
    let velocity: [f64; 2] = numbers.try_into().map_err(|_| fail())?;
    let is_inside = velocity.iter().all(|speed| speed.abs() <= 1e5);
    if is_inside { Ok(Velocity(velocity)) } else { Err(fail()) }
}

/// Scripts read these names.
#[derive(Serialize, Debug)]
struct Report {
    width: u32,
    height: u32,
    /// Frames of which light was collected.
    frames: usize,
    /// Mean of the collected light over that of the display's white, red green and blue.
    light: [f64; 3],
    /// Against the reference, 8-bit codes of all channels together; 100 where they are equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    psnr_rgb_db: Option<f64>,
}

pub(super) fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let profile = read_profile(&args.profile)?;
    let (start_s, window_s) = (args.start_ms / 1e3, args.window_ms / 1e3);
    let shown_s = args.frames.len() as f64 / args.refresh;
    ensure!(
        start_s + window_s <= shown_s + 1e-9,
        "expected frames for {:.1} ms, found {:.1} ms; give more frames or a shorter --window-ms",
        args.start_ms + args.window_ms,
        shown_s * 1e3
    );
    let planes = collect(args, &profile, start_s, window_s)?;
    let image = encode(&planes, profile.model());
    if let Some(path) = &args.out {
        image.save(path).with_context(|| format!("writing {}", path.display()))?;
    }
    let psnr = args.reference.as_deref().map(|path| psnr(&image, path)).transpose()?;
    let first = (start_s * args.refresh).floor();
    let last = ((start_s + window_s) * args.refresh - 1e-9).floor();
    let report = Report {
        width: image.width(),
        height: image.height(),
        frames: (last - first) as usize + 1,
        light: [0, 1, 2].map(|channel| round(planes[channel].mean())),
        psnr_rgb_db: psnr.map(round),
    };
    let compared = psnr.map_or_else(String::new, |db| format!(", {db:.2} dB of the reference"));
    let text = format!(
        "{}x{} from {} frames, mean light {:.3} {:.3} {:.3}{compared}",
        report.width,
        report.height,
        report.frames,
        report.light[0],
        report.light[1],
        report.light[2]
    );
    output.result(&report, &text)
}

/// Light on the retina, one plane per channel.
fn collect(
    args: &Args,
    profile: &DisplayProfile,
    start_s: f64,
    window_s: f64,
) -> anyhow::Result<[Plane; 3]> {
    let images =
        args.frames.iter().map(|path| read_png(path)).collect::<anyhow::Result<Vec<_>>>()?;
    let Velocity(velocity) = args.velocity;
    let persistence = args.persistence.unwrap_or(profile.persistence());
    let mut planes = Vec::with_capacity(3);
    for channel in 0..3 {
        let light: Vec<f32> = (0..=255_u8)
            .map(|level| profile.model().light([f64::from(level) / 255.0; 3])[channel] as f32)
            .collect();
        let frames: Vec<Plane> = images
            .iter()
            .map(|image| {
                let pixels = image.pixels().map(|pixel| light[usize::from(pixel.0[channel])]);
                Plane::new(image.width() as usize, image.height() as usize, pixels.collect())
            })
            .collect::<Option<_>>()
            .context("expected pictures with pixels")?;
        let lit: Vec<_> = lit_frames(&frames, args.refresh, persistence).collect();
        let mut plane = retinal_image(&lit, start_s, window_s, |_, _| velocity)?;
        if let (Some(motion), Some(ppd)) = (args.motion, args.ppd) {
            plane = pursuit_blurred(&plane, velocity, ppd, motion.into())?;
        }
        planes.push(plane);
    }
    planes.try_into().map_err(|_| anyhow::anyhow!("expected three channels"))
}

fn encode(planes: &[Plane; 3], model: &GainOffsetGamma) -> RgbImage {
    let (width, height) = (planes[0].width() as u32, planes[0].height() as u32);
    RgbImage::from_fn(width, height, |x, y| {
        let index = y as usize * planes[0].width() + x as usize;
        let light = [0, 1, 2].map(|channel| f64::from(planes[channel].values()[index]));
        Rgb(model.codes_of_light(light).map(|code| (code * 255.0).round() as u8))
    })
}

fn psnr(image: &RgbImage, path: &Path) -> anyhow::Result<f64> {
    let reference = read_png(path)?;
    ensure!(
        image.dimensions() == reference.dimensions(),
        "{}: expected {:?} pixels, found {:?}",
        path.display(),
        image.dimensions(),
        reference.dimensions()
    );
    let square = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b)).powi(2);
    let count = image.as_raw().len() as f64;
    let error = image.as_raw().iter().zip(reference.as_raw()).map(square).sum::<f64>() / count;
    Ok(if error > 0.0 { 10.0 * (255.0_f64.powi(2) / error).log10() } else { 100.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_are_two_numbers() {
        assert_eq!(parse_velocity("-960,0.5").unwrap(), Velocity([-960.0, 0.5]));
        for text in ["", "1", "1,2,3", "1,nan", "1e6,0"] {
            assert!(parse_velocity(text).unwrap_err().contains(&format!("`{text}`")), "{text}");
        }
    }
}
