//! Looks for what is wrong with a capture: its motion, by the engine's own check, and the bits of
//! its colours, by the banding model. Without one, with the [`machine`].

mod gradients;
pub mod machine;

use std::path::Path;

use anyhow::Context as _;
use foreframe_engine::{ColorPlane, Engine, EngineConfig, Method};
use foreframe_perception::display::DisplayProfile;
use foreframed::sink::srgb::SrgbConverter;
use serde::Serialize;

use crate::recording::capture::CaptureRecording;
use crate::recording::{Recording, Wanted};
use crate::score::picture::{Srgb8, to_srgb8};
use gradients::smooth_gradients;

/// Gradients of a picture that the model is asked about, evenly spread over all that were found.
const MOST_ASKED: usize = 32;
/// What `rgba8` holds.
const SHALLOW_BITS: u8 = 8;
/// What `rgb10a2` holds.
const DEEP_BITS: u8 = 10;

/// What to look at, and for which display.
#[derive(Clone, Copy, Debug)]
pub struct Examination<'a> {
    /// Keys whose motion is looked at, the first that move.
    pub keys: u32,
    /// Pixels per degree of visual angle.
    pub ppd: f64,
    /// What the display makes of codes.
    pub profile: &'a DisplayProfile,
}

/// What was found. Names are part of the interface.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Report {
    /// Of the motion.
    pub motion: MotionReport,
    /// Of the colours.
    pub colour: ColourReport,
}

/// Whether the motion is what the stream declares.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MotionReport {
    /// Keys that were looked at and moved.
    pub keys: u32,
    /// Samples that move.
    pub samples: u64,
    /// The error of every way of reading that the capture has data for.
    pub hypotheses: Vec<Finding>,
    /// What is wrong; none where nothing was found.
    pub verdict: Option<String>,
}

/// The error of one way of reading.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Finding {
    /// Name of the way of reading.
    pub name: &'static str,
    /// Root of the mean squared difference of luma, 8-bit levels.
    pub rms_levels: f64,
}

/// How many bits the colours need.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct ColourReport {
    /// Smooth gradients that were looked at.
    pub gradients: usize,
    /// Fewest bits per channel that hide the steps of all of them. None if 16 do not.
    pub min_bits: Option<u8>,
    /// The narrowest wire format that has as many.
    pub format: &'static str,
}

/// Looks into a capture.
///
/// # Errors
/// If it cannot be read, or has no motion that could be looked at.
pub fn examine_file(path: &Path, examination: &Examination<'_>) -> anyhow::Result<Report> {
    let mut recording = CaptureRecording::open(path)?;
    examine(&mut recording, examination).with_context(|| format!("looking into {}", path.display()))
}

/// Looks into a recording.
///
/// # Errors
/// If a frame cannot be read, or there is no motion plane.
pub fn examine(
    recording: &mut dyn Recording,
    examination: &Examination<'_>,
) -> anyhow::Result<Report> {
    let format = *recording.format();
    let threads = std::thread::available_parallelism()?;
    let config = EngineConfig {
        keys_to_check: examination.keys,
        ..EngineConfig::new(Method::Hold, threads)
    };
    let mut engine = Engine::new(format, config);
    let heads = recording.heads().to_vec();
    let mut before = None;
    for (frame, head) in heads.iter().enumerate() {
        if engine.motion_check().is_done() {
            break;
        }
        // The plane that points back to the frame before, if there are several.
        let plane = head.motions.iter().position(|from| Some(*from) == before);
        let motion = plane.or_else(|| (!head.motions.is_empty()).then_some(0));
        let read = recording.read(frame, Wanted::Key { motion })?;
        engine.push_key(&read.as_input()).with_context(|| format!("frame {}", read.index))?;
        before = Some(head.content_time);
    }
    let diagnosis = engine.motion_check().diagnosis();
    if format.motion.is_none() {
        anyhow::bail!("expected a motion plane, found none: nothing can be said of motion");
    }
    let mut picture = ColorPlane::default();
    let shown = before.and_then(|at| engine.synthesise(at, &mut picture));
    let colour = match shown {
        Some(_) => needed_bits(&to_srgb8(&picture, &SrgbConverter::new(&format)), examination)?,
        None => anyhow::bail!("expected at least one frame, found none"),
    };
    let named = |&(hypothesis, rms_levels): &(foreframe_engine::diagnosis::Hypothesis, f64)| {
        Finding { name: hypothesis.name(), rms_levels }
    };
    Ok(Report {
        motion: MotionReport {
            keys: diagnosis.keys,
            samples: diagnosis.samples,
            hypotheses: diagnosis.errors.iter().map(named).collect(),
            verdict: diagnosis.verdict,
        },
        colour,
    })
}

/// How many bits the smooth gradients of a picture need.
fn needed_bits(picture: &Srgb8, examination: &Examination<'_>) -> anyhow::Result<ColourReport> {
    let found = smooth_gradients(picture);
    let asked = found.len().min(MOST_ASKED);
    let xyz = |codes| examination.profile.model().xyz(codes);
    let mut min_bits = Some(1);
    for place in 0..asked {
        let gradient = &found[place * found.len() / asked];
        let bits = gradient.least_bits(examination.ppd, xyz)?;
        min_bits = min_bits.zip(bits).map(|(most, bits)| most.max(bits));
    }
    let format = match min_bits {
        Some(..=SHALLOW_BITS) => "rgba8",
        Some(..=DEEP_BITS) => "rgb10a2",
        _ => "rgba16f",
    };
    Ok(ColourReport { gradients: found.len(), min_bits, format })
}

#[cfg(test)]
mod tests;
