//! `foreframe scenes`: lists the built-in scenes, or writes one as a capture or as pictures.
//!
//! A capture has colour, depth and motion at every frame, motion over three frames at every third
//! and over four at every fourth: what an application that renders only those would hand over.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use foreframe_fixtures::client::{stream_options, wire_camera};
use foreframe_fixtures::sequence::motion_bytes;
use foreframe_fixtures::{Recipe, RenderedKey, Renderer, SCENES, Sampling, SceneInfo, Size};
use foreframe_protocol::{
    CreateStream, MotionFormat, PlaneDescriptor, PlaneKind, PlaneMap, PlaneSize, Submit,
};
use foreframed::capture::{
    CaptureSource, CaptureWriter, Coding, PlaneBytes, PlaneInfo, SessionInfo,
};
use serde::Serialize;

use crate::options::{number, parse_scene};
use crate::output::Output;

/// Steps, in frames, over which motion is written besides that from frame to frame.
const KEY_STEPS: [u32; 2] = [3, 4];
/// Motion is written as exactly as it is known: what is scored against it stands on it.
const MOTION: MotionFormat = MotionFormat::Rg32f;
/// Content time of the first frame: late enough that its motion points to a time above 0.
const START_NS: u64 = 1_000_000_000;

/// Arguments of `foreframe scenes`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Scene to write; without it, all scenes are listed.
    #[arg(requires = "target", value_parser = parse_scene)]
    pub name: Option<&'static SceneInfo>,
    /// Capture to write.
    #[arg(short, long, value_name = "FILE.mcap", group = "target", requires = "name")]
    pub output: Option<PathBuf>,
    /// Folder to write one PNG per frame to; made if it is not there.
    #[arg(long, value_name = "DIR", group = "target", requires = "name")]
    pub png: Option<PathBuf>,
    /// Size of the pictures.
    #[arg(long, value_name = "WxH", default_value = "640x360", value_parser = parse_size)]
    pub size: Size,
    /// Frames per second, 1 to 1000.
    #[arg(long, value_name = "HZ", default_value_t = 120.0, value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    pub rate: f64,
    /// Time from the first to the last frame, 0 to 60.
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = number(0.0, 60.0))]
    #[arg(allow_negative_numbers = true)]
    pub seconds: f64,
    /// Colour is this much larger per axis than depth and motion, 1 to 4.
    #[arg(long, value_name = "R", default_value_t = 1.0, value_parser = number(1.0, 4.0))]
    #[arg(allow_negative_numbers = true)]
    pub field_ratio: f64,
}

#[derive(Serialize)]
struct Listing {
    scenes: Vec<Line>,
}

#[derive(Serialize)]
struct Line {
    name: &'static str,
    summary: &'static str,
    hard: &'static str,
    source: &'static str,
}

#[derive(Serialize)]
struct Written<'a> {
    scene: &'a str,
    path: &'a Path,
    frames: u32,
    width: u32,
    height: u32,
}

/// Lists or writes.
///
/// # Errors
/// If a file cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let Some(info) = args.name else { return list(output) };
    #[expect(clippy::cast_possible_truncation, reason = "at most 60,000 frames")]
    #[expect(clippy::cast_sign_loss, reason = "seconds and rate are positive")]
    let frames = (args.seconds * args.rate).round() as u32 + 1;
    let shot = Shot { renderer: Renderer::new((info.build)()), args, frames };
    let path = match (&args.output, &args.png) {
        (Some(path), _) => shot.write_capture(info, path, output).map(|()| path)?,
        (None, Some(dir)) => shot.write_pictures(dir, output).map(|()| dir)?,
        (None, None) => anyhow::bail!("expected -o FILE.mcap or --png DIR"),
    };
    let Size { width, height } = args.size;
    let written = Written { scene: info.name, path, frames, width, height };
    output.result(&written, &format!("{frames} frames of {} are in {}", info.name, path.display()))
}

fn list(output: &Output) -> anyhow::Result<()> {
    let scenes: Vec<_> = SCENES
        .iter()
        .map(|&SceneInfo { name, summary, hard, source, .. }| Line { name, summary, hard, source })
        .collect();
    let text: Vec<_> =
        scenes.iter().map(|line| format!("{:15} {}", line.name, line.summary)).collect();
    output.result(&Listing { scenes }, &text.join("\n"))
}

struct Shot<'a> {
    renderer: Renderer,
    args: &'a Args,
    frames: u32,
}

impl Shot<'_> {
    /// Time in the scene of a frame, which may lie before the first.
    fn time(&self, frame: i64) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "frame numbers are small")]
        let frame = frame as f64;
        frame / self.args.rate
    }

    /// Content time of a frame.
    #[expect(clippy::cast_possible_truncation, reason = "a minute at most")]
    fn content_time_ns(&self, frame: i64) -> u64 {
        START_NS.saturating_add_signed((self.time(frame) * 1e9).round() as i64)
    }

    fn write_pictures(&self, dir: &Path, output: &Output) -> anyhow::Result<()> {
        fs::create_dir_all(dir).with_context(|| format!("making {}", dir.display()))?;
        let progress = output.progress("rendering", u64::from(self.frames));
        for frame in 0..self.frames {
            let picture =
                self.renderer.color(self.time(frame.into()), self.args.size, Sampling::Sixteen);
            let path = dir.join(format!("frame_{frame:04}.png"));
            let Size { width, height } = picture.size;
            image::save_buffer(&path, &picture.rgba, width, height, image::ColorType::Rgba8)
                .with_context(|| format!("writing {}", path.display()))?;
            progress.inc(1);
        }
        progress.finish_and_clear();
        Ok(())
    }

    fn write_capture(&self, info: &SceneInfo, path: &Path, output: &Output) -> anyhow::Result<()> {
        let recipe = Recipe {
            size: self.args.size,
            sampling: Sampling::Sixteen,
            depth_ratio: self.args.field_ratio,
            motion_ratio: self.args.field_ratio,
        };
        let create = stream_options(&recipe, MOTION).to_message(1);
        let session = SessionInfo::new(info.name, CaptureSource::Scene)
            .with_config("rate_hz", self.args.rate)
            .with_config("field_ratio", self.args.field_ratio);
        let context = || format!("writing {}", path.display());
        let mut writer =
            CaptureWriter::create(path, &session).with_context(context)?.with_coding(Coding::SMALL);
        writer.add_stream(&create).with_context(context)?;
        let progress = output.progress("rendering", u64::from(self.frames));
        for frame in 0..self.frames {
            self.write_frame(&mut writer, &create, &recipe, frame).with_context(context)?;
            progress.inc(1);
        }
        progress.finish_and_clear();
        writer.finish().with_context(context)?;
        Ok(())
    }

    fn write_frame(
        &self,
        writer: &mut CaptureWriter,
        create: &CreateStream,
        recipe: &Recipe,
        frame: u32,
    ) -> anyhow::Result<()> {
        let number = i64::from(frame);
        let (time, before) = (self.time(number), self.time(number - 1));
        let key = RenderedKey::render(&self.renderer, recipe, time, before);
        let (depth, motion) = (key.depth_bytes(), key.motion_bytes(MOTION));
        let content_time_ns = self.content_time_ns(number);
        let motion_from_ns = self.content_time_ns(number - 1);
        let planes = [
            (PlaneKind::Color, key.color.size, 4, &key.color.rgba),
            (PlaneKind::Depth, key.depth_size, 4, &depth),
            (PlaneKind::Motion, key.motion_size, MOTION.bytes_per_pixel(), &motion),
        ];
        let mut described = PlaneMap::default();
        let mut records = Vec::new();
        for (kind, Size { width, height }, bytes_per_pixel, bytes) in planes {
            let size = PlaneSize { width, height };
            let descriptor = PlaneDescriptor::packed(0, size, bytes_per_pixel);
            described.set(kind, Some(descriptor));
            let info =
                PlaneInfo::described(&create.format, kind, &descriptor, Some(motion_from_ns))
                    .context("the stream declares every plane that is written")?;
            records.push((info, bytes.clone()));
        }
        let (motion_info, _) = records[2];
        let steps = KEY_STEPS.into_iter().filter(|step| frame.is_multiple_of(*step));
        for (which, step) in (1..).zip(steps) {
            let from = number - i64::from(step);
            let size = self.args.size;
            let fields = self.renderer.fields(
                time,
                self.time(from),
                size,
                size.reduced(recipe.motion_ratio),
            );
            let motion_from_ns = Some(self.content_time_ns(from));
            let info = PlaneInfo { which, motion_from_ns, ..motion_info };
            records.push((info, motion_bytes(&fields.motion, MOTION)));
        }
        let submit = Submit {
            stream: create.stream,
            slot: 0,
            key_index: u64::from(frame),
            content_time_ns,
            motion_from_ns: Some(motion_from_ns),
            is_cut: false,
            planes: described,
            camera: Some(wire_camera(&key.camera)),
            motion_from_camera: Some(wire_camera(&key.motion_from_camera)),
        };
        let planes: Vec<_> =
            records.iter().map(|(info, bytes)| PlaneBytes::tight(*info, bytes)).collect();
        writer.write_frame(content_time_ns, &submit, &planes)?;
        Ok(())
    }
}

/// Parses `WIDTHxHEIGHT`.
pub(crate) fn parse_size(text: &str) -> Result<Size, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=Size::MAX).contains(side));
    text.split_once('x')
        .and_then(|(width, height)| Some(Size::new(side(width)?, side(height)?)))
        .ok_or_else(|| format!("expected WIDTHxHEIGHT of 1 to {}, found `{text}`", Size::MAX))
}

#[cfg(test)]
mod tests {
    use foreframed::capture::Capture;

    use super::*;

    #[test]
    fn the_motion_of_a_capture_is_that_of_the_scene_over_each_step() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pan.mcap");
        let info = SceneInfo::by_name("pan").unwrap();
        let args = Args {
            name: Some(info),
            output: Some(path.clone()),
            png: None,
            size: Size::new(50, 30),
            rate: 100.0,
            seconds: 0.04,
            field_ratio: 1.5,
        };
        let shot = Shot { renderer: Renderer::new((info.build)()), args: &args, frames: 5 };
        shot.write_capture(info, &path, &Output::new(true)).unwrap();
        let capture = Capture::open(&path).unwrap();
        assert_eq!(capture.streams()[0].format.motion.unwrap().format, MotionFormat::Rg32f);
        let last = capture.frame(4).unwrap();
        for step in [1, 4] {
            let motion = last.motion_from(shot.content_time_ns(4 - step)).unwrap();
            let (floats, rest) = motion.bytes.as_chunks::<4>();
            assert!(rest.is_empty());
            let found: Vec<f32> = floats.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
            let size = args.size;
            let (time, from) = (shot.time(4), shot.time(4 - step));
            let fields = shot.renderer.fields(time, from, size, size.reduced(1.5));
            assert_eq!(found, fields.motion.as_flattened(), "over {step} frames");
            assert!(found.iter().any(|motion| motion.abs() > 0.1), "the scene moves");
        }
        assert!(last.motion_from(shot.content_time_ns(1)).is_none(), "only every third has three");
    }
}
