//! Table 5.1 of Denes 2020, computed: what each technique costs and saves.
//!
//! Peak luminance is the mean light of a white screen. Blur is the width of a moving line on the
//! retina, as its light over its peak. Flicker is the highest probability of detection on a still
//! picture with white, where motion does not come in. Judder is the contrast that is left at half
//! the display's rate of what moves, see [`crate::window`].

use super::{Technique, sequence};
use crate::PerceptionError;
use crate::flicker::FlickerModel;
use crate::plane::Plane;
use crate::retina::{lit_frames, retinal_image};

/// What to compute the table for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Conditions {
    /// Refresh rate of the display, Hz.
    pub refresh_hz: f64,
    /// Pixels per degree.
    pub ppd: f64,
    /// Luminance of white, cd/m2.
    pub peak: f64,
    /// Motion of the line, whole pixels per frame of the display.
    pub motion_px: u8,
    /// The gamma in which frames are resampled.
    pub gamma: f32,
}

impl Conditions {
    /// The display of table 7.2 at 120 Hz and the resolution of chapter 7, and a line that moves by
    /// 8 pixels a frame: 18.5 deg/s.
    pub const DEFAULT: Self =
        Self { refresh_hz: 120.0, ppd: 52.0, peak: 156.0, motion_px: 8, gamma: 2.2 };
}

/// A row of the table.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Row {
    /// Which.
    pub technique: Technique,
    /// Mean light of white, share of what the display can show.
    pub peak_luminance: f64,
    /// Width of the moving line on the retina, px.
    pub blur_px: f64,
    /// Highest probability that flicker is detected.
    pub flicker: f64,
    /// Share of pixels that need not be rendered.
    pub pixels_saved: f64,
}

/// Background and light of the line: neither is close enough to a limit of the display for
/// sharpening to clip by much.
const LINE: [f32; 2] = [0.2, 0.5];
/// Thickness of the line, px.
const THICK_PX: f64 = 2.0;
/// Side of the pictures, px.
const SIDE: usize = 192;

/// The row of one technique.
///
/// # Errors
/// If a condition is out of its range.
pub fn row(technique: Technique, at: &Conditions) -> Result<Row, PerceptionError> {
    Ok(Row {
        technique,
        peak_luminance: peak_luminance(technique, at)?,
        blur_px: blur_px(technique, at)?,
        flicker: flicker(technique, at)?,
        pixels_saved: technique.pixels_saved(),
    })
}

fn peak_luminance(technique: Technique, at: &Conditions) -> Result<f64, PerceptionError> {
    let white = |_| Plane::filled(16, 16, 1.0);
    let frames = sequence(technique, 2, at.gamma, [0.0; 2], white)?;
    Ok(frames.iter().map(Plane::mean).sum::<f64>() / frames.len() as f64)
}

fn blur_px(technique: Technique, at: &Conditions) -> Result<f64, PerceptionError> {
    let columns = line_on_retina(technique, at)?;
    let background = columns[1];
    let above = columns.iter().map(|light| (light - background).max(0.0));
    let peak = above.clone().fold(0.0, f64::max);
    Ok(above.sum::<f64>() / peak)
}

/// Light on the retina across the line, one value per pixel, averaged over a pair of frames. Eyes
/// follow the line perfectly.
///
/// # Errors
/// If a condition is out of its range.
pub fn line_on_retina(technique: Technique, at: &Conditions) -> Result<Vec<f64>, PerceptionError> {
    let motion = f64::from(at.motion_px);
    let line = |time: f64| {
        let from = SIDE as f64 / 4.0 + motion * time;
        Plane::from_fn(SIDE, 4, |x, _| {
            let is_line = (from..from + THICK_PX).contains(&(x as f64));
            LINE[usize::from(is_line)]
        })
    };
    PerceptionError::check_positive("refresh_hz", at.refresh_hz)?;
    let motion_px = [f32::from(at.motion_px), 0.0];
    let frames = sequence(technique, 8, at.gamma, motion_px, line)?;
    let lit: Vec<_> = lit_frames(&frames, at.refresh_hz, 1.0).collect();
    let pair_s = 2.0 / at.refresh_hz;
    let gaze = [motion * at.refresh_hz, 0.0];
    let image = retinal_image(&lit, 2.0 * pair_s, pair_s, |_, _| gaze)?;
    // Interlacing has other light in even rows than in odd ones; a viewer sees their mean.
    let column = |x: usize| f64::from(image.at(x.cast_signed(), 1) + image.at(x.cast_signed(), 2));
    Ok((0..SIDE).map(|x| column(x) / 2.0).collect())
}

fn flicker(technique: Technique, at: &Conditions) -> Result<f64, PerceptionError> {
    let still = |_| {
        Plane::from_fn(SIDE, SIDE, |x, y| match (x * 2 / SIDE, y * 2 / SIDE) {
            (0, 0) => 1.0,
            (1, 0) => 0.5 + 0.3 * libm::sinf(x as f32 * 0.21) * libm::cosf(y as f32 * 0.17),
            (0, _) => 0.1 + 0.2 * f32::from(u8::from((x + y) / 8 % 2 == 0)),
            _ => 0.3 + 0.1 * libm::sinf((x + 2 * y) as f32 * 0.5),
        })
    };
    let frames = sequence(technique, 4, at.gamma, [0.0; 2], still)?;
    let luminance = |frame: &Plane| frame.map(|light| light * at.peak as f32);
    let model = FlickerModel::new(at.refresh_hz, at.ppd)?;
    Ok(model.map(&luminance(&frames[2]), &luminance(&frames[3]))?.max().into())
}
