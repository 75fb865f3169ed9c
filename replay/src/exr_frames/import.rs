//! A folder of EXR frames and side-cars becomes a capture.
//!
//! Frames go in one after another, in the order of their numbers; one is in memory at a time. A
//! frame from files arrived at its content time. The capture appears under its name when it is
//! whole: an import that fails leaves nothing behind.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::Path;

use anyhow::{Context as _, ensure};
use foreframe_protocol::limits::{DEFAULT_SLOTS, OFFSET_ALIGN};
use foreframe_protocol::{
    Body as _, ColorFormat, CreateStream, PlaneDescriptor, PlaneKind, PlaneMap, PlaneSize, Rect,
    StreamFormat, Submit,
};
use foreframed::capture::{
    CaptureSource, CaptureWriter, Coding, PlaneBytes, PlaneInfo, SessionInfo, pixel_layout,
};

use super::blender;
use super::exported::{self, Exported};
use super::image::ExrImage;
use super::sidecar::{self, Sidecar};
use super::sky::SkyMotion;
use crate::whole_file;

/// Content time of time 0 of a sequence. Motion of its first frames points further back, and no
/// time is negative.
pub const ORIGIN_NS: u64 = 1_000_000_000;
/// Number of the one stream of an imported capture.
const STREAM: u32 = 1;

/// How to import.
#[derive(Clone, Debug)]
pub struct Options {
    /// Name of the capture; that of the folder where it is not given.
    pub name: Option<String>,
    /// How planes are stored.
    pub coding: Coding,
}

/// What was imported.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Imported {
    /// Frames.
    pub frames: u64,
    /// Depth planes.
    pub depths: u64,
    /// Motion planes, of all spans.
    pub motions: u64,
    /// Bytes of all planes, before compression.
    pub raw_bytes: u64,
    /// Bytes of all planes in the file.
    pub stored_bytes: u64,
}

/// One frame on its way from files to the capture.
struct Frame {
    submit: Submit,
    arrived_at_ns: u64,
    planes: Vec<(PlaneInfo, Vec<u8>)>,
}

/// A folder whose side-cars have been read.
struct Sequence<'a> {
    folder: &'a Path,
    sidecars: BTreeMap<u64, Sidecar>,
    format: StreamFormat,
}

/// Imports `folder` as the file `out`. `progress` is called with the number of frames done and
/// that of all.
///
/// # Errors
/// If a file is missing, cannot be read, or does not hold what it must; the message names it.
pub fn import(
    folder: &Path,
    out: &Path,
    options: &Options,
    mut progress: impl FnMut(u64, u64),
) -> anyhow::Result<Imported> {
    let sequence = Sequence::open(folder)?;
    let name = options.name.clone().unwrap_or_else(|| sequence.name());
    let session =
        SessionInfo::new(name, CaptureSource::Import).with_config("time_origin_ns", ORIGIN_NS);
    let file = whole_file::beside(out)?;
    let mut writer =
        CaptureWriter::to_writer(BufWriter::new(file), &session)?.with_coding(options.coding);
    let format = sequence.format;
    let max_sizes = format.full_sizes();
    let create = CreateStream { stream: STREAM, format, max_sizes, slots: DEFAULT_SLOTS };
    create.validate().with_context(|| folder.display().to_string())?;
    writer.add_stream(&create)?;
    let mut imported = Imported::default();
    let all = sequence.sidecars.len() as u64;
    for sidecar in sequence.sidecars.values() {
        let frame = sequence.frame(sidecar).with_context(|| format!("frame {}", sidecar.frame))?;
        let planes: Vec<_> =
            frame.planes.iter().map(|(info, bytes)| PlaneBytes::tight(*info, bytes)).collect();
        imported.stored_bytes += writer
            .write_frame(frame.arrived_at_ns, &frame.submit, &planes)
            .with_context(|| format!("frame {}", sidecar.frame))?;
        imported.frames += 1;
        for (info, _) in &frame.planes {
            imported.raw_bytes += info.raw_len();
            imported.depths += u64::from(info.kind == PlaneKind::Depth);
            imported.motions += u64::from(info.kind == PlaneKind::Motion);
        }
        progress(imported.frames, all);
    }
    let file = writer.finish()?.into_inner().context("writing the capture")?;
    whole_file::put(file, out)?;
    Ok(imported)
}

impl<'a> Sequence<'a> {
    fn open(folder: &'a Path) -> anyhow::Result<Self> {
        let mut sidecars = BTreeMap::new();
        for (number, path) in sidecar::list(folder)? {
            let sidecar = Sidecar::read(&path)?;
            ensure!(
                sidecar.frame == number,
                "{}: expected frame {number} as the file name says, found {}",
                path.display(),
                sidecar.frame
            );
            sidecars.insert(number, sidecar);
        }
        let first = sidecars.values().next().expect("a list of side-cars is not empty");
        let (width, height) = (first.width, first.height);
        let format = match &first.foreframe {
            Some(exported) => exported.format.parse(width, height)?,
            None => {
                let image = open_image(folder, first, "color")?;
                let color = blender::LinearColor::read(&image, (width, height))?;
                let color = match color.first_off_level() {
                    None => ColorFormat::Rgba8,
                    Some(_) => ColorFormat::Rgba16f,
                };
                blender::stream_format(width, height, color)
            }
        };
        Ok(Self { folder, sidecars, format })
    }

    fn name(&self) -> String {
        let given = self.sidecars.values().find_map(|sidecar| sidecar.name.clone());
        let of_folder = || {
            let folder = self.folder.canonicalize().ok()?;
            Some(folder.file_name()?.to_string_lossy().into_owned())
        };
        given.or_else(of_folder).unwrap_or_else(|| "import".to_owned())
    }

    fn frame(&self, sidecar: &Sidecar) -> anyhow::Result<Frame> {
        let (expected, found) =
            ((self.format.width, self.format.height), (sidecar.width, sidecar.height));
        ensure!(
            found == expected,
            "expected {}x{} pixels as in the first frame, found {}x{}",
            expected.0,
            expected.1,
            found.0,
            found.1
        );
        let frame = match &sidecar.foreframe {
            Some(exported) => self.exported_frame(sidecar, exported),
            None => self.rendered_frame(sidecar),
        }?;
        frame.submit.validate()?;
        Ok(frame)
    }

    /// A frame that [`super::export`] wrote.
    fn exported_frame(&self, sidecar: &Sidecar, exported: &Exported) -> anyhow::Result<Frame> {
        let image = open_image(self.folder, sidecar, "color")?;
        let mut planes = Vec::with_capacity(exported.planes.len());
        for text in &exported.planes {
            let info = text.parse(&self.format)?;
            let bytes = exported::read_plane(&image, &self.format, &info)
                .with_context(|| format!("the {} plane", text.kind))?;
            planes.push((info, bytes));
        }
        let submit = Submit {
            key_index: exported.key_index,
            content_time_ns: exported.content_time_ns,
            motion_from_ns: exported.motion_from_ns,
            motion_from_camera: exported.motion_from_camera(),
            ..self.submit(sidecar, &planes)?
        };
        Ok(Frame { submit, arrived_at_ns: exported.arrived_at_ns, planes })
    }

    /// A frame that a renderer wrote.
    fn rendered_frame(&self, sidecar: &Sidecar) -> anyhow::Result<Frame> {
        let size = (sidecar.width, sidecar.height);
        let image = open_image(self.folder, sidecar, "color")?;
        let color = blender::LinearColor::read(&image, size)?;
        if self.format.color == ColorFormat::Rgba8 {
            let off = color.first_off_level();
            ensure!(
                off.is_none(),
                "expected colour on the 256 sRGB levels as in the first frame, found {}",
                off.unwrap_or_default()
            );
        }
        let mut planes =
            vec![self.plane(PlaneKind::Color, 0, None, color.pixels(self.format.color))?];
        // The planes may stand beside the colour, in one multi-layer file.
        let data = match sidecar.files.contains_key("data") {
            true => open_image(self.folder, sidecar, "data")?,
            false => image,
        };
        let depth = blender::depth(&data, size)?;
        if let Some(depth) = &depth {
            planes.push(self.plane(PlaneKind::Depth, 0, None, blender::depth_pixels(depth))?);
        }
        let mut which = 0;
        let mut add = |step: u64, image: &ExrImage| -> anyhow::Result<()> {
            let earlier = sidecar.frame.checked_sub(step).and_then(|n| self.sidecars.get(&n));
            let sky = self.sky(sidecar, earlier)?;
            let motion = blender::motion_pixels(image, size, depth.as_deref(), sky.as_ref())?;
            if let Some(pixels) = motion {
                let from = self.time_of_step(sidecar, step)?;
                planes.push(self.plane(PlaneKind::Motion, which, Some(from), pixels)?);
                which += 1;
            }
            Ok(())
        };
        add(1, &data)?;
        for (step, file) in steps(sidecar) {
            add(step, &open_image(self.folder, sidecar, file)?)?;
        }
        let submit = self.submit(sidecar, &planes)?;
        Ok(Frame { arrived_at_ns: submit.content_time_ns, submit, planes })
    }

    fn plane(
        &self,
        kind: PlaneKind,
        which: u8,
        motion_from_ns: Option<u64>,
        bytes: Vec<u8>,
    ) -> anyhow::Result<(PlaneInfo, Vec<u8>)> {
        let (width, height) = (self.format.width, self.format.height);
        let layout = pixel_layout(&self.format, kind).context("a plane that is not declared")?;
        let valid = Rect::full(width, height);
        let jitter = [0.0; 2];
        let info = PlaneInfo { kind, which, layout, width, height, valid, jitter, motion_from_ns };
        Ok((info, bytes))
    }

    fn sky(&self, now: &Sidecar, then: Option<&Sidecar>) -> anyhow::Result<Option<SkyMotion>> {
        let Some(then) = then else { return Ok(None) };
        Ok(match (now.camera()?, then.camera()?) {
            (Some(now), Some(then)) => {
                Some(SkyMotion::new(&now, &then, self.format.width, self.format.height))
            }
            _ => None,
        })
    }

    /// Content time of the frame `step` frames before this one, whether or not it is there.
    fn time_of_step(&self, sidecar: &Sidecar, step: u64) -> anyhow::Result<u64> {
        let earlier = sidecar.frame.checked_sub(step).and_then(|n| self.sidecars.get(&n));
        if let Some(earlier) = earlier {
            return Ok(ORIGIN_NS + earlier.time_ns());
        }
        let fps = sidecar.fps.filter(|&fps| fps.is_finite() && fps > 0.0);
        let fps = fps.with_context(|| {
            format!(
                "motion points back {step} frames: expected that frame or `fps` in the side-car, \
                 found neither"
            )
        })?;
        #[expect(clippy::cast_possible_truncation, reason = "float to int casts saturate")]
        #[expect(clippy::cast_sign_loss, reason = "float to int casts saturate")]
        #[expect(clippy::cast_precision_loss, reason = "steps are small numbers")]
        let back = (step as f64 / fps * 1e9).round() as u64;
        let now = ORIGIN_NS + sidecar.time_ns();
        now.checked_sub(back).with_context(|| {
            format!("expected motion over less than {now} ns, found {step} frames of {back} ns")
        })
    }

    fn submit(&self, sidecar: &Sidecar, planes: &[(PlaneInfo, Vec<u8>)]) -> anyhow::Result<Submit> {
        let mut descriptors = PlaneMap::default();
        let mut offset = 0_u64;
        for (info, _) in planes.iter().filter(|(info, _)| info.which == 0) {
            let size = PlaneSize { width: info.width, height: info.height };
            let bytes_per_pixel = u32::try_from(info.layout.pixel_bytes())?;
            let descriptor = PlaneDescriptor {
                valid: info.valid,
                jitter: info.jitter,
                ..PlaneDescriptor::packed(offset, size, bytes_per_pixel)
            };
            descriptors.set(info.kind, Some(descriptor));
            offset = (offset + info.raw_len()).next_multiple_of(OFFSET_ALIGN);
        }
        let motion = planes.iter().find(|(info, _)| info.kind == PlaneKind::Motion);
        let motion_from_ns = motion.and_then(|(info, _)| info.motion_from_ns);
        let earlier = self.sidecars.values().find(|earlier| {
            motion_from_ns.is_some_and(|time| ORIGIN_NS + earlier.time_ns() == time)
        });
        Ok(Submit {
            stream: STREAM,
            slot: 0,
            key_index: sidecar.frame,
            content_time_ns: ORIGIN_NS + sidecar.time_ns(),
            motion_from_ns,
            is_cut: sidecar.is_first_frame_after_cut,
            planes: descriptors,
            camera: sidecar.camera()?,
            motion_from_camera: earlier.map(Sidecar::camera).transpose()?.flatten(),
        })
    }
}

fn open_image(folder: &Path, sidecar: &Sidecar, what: &str) -> anyhow::Result<ExrImage> {
    let Some(file) = sidecar.files.get(what) else {
        let has: Vec<_> = sidecar.files.keys().map(String::as_str).collect();
        anyhow::bail!(
            "expected `{what}` among the files of the side-car, found {}",
            has.join(", ")
        );
    };
    ExrImage::read(&folder.join(file))
}

/// Files with motion over several frames: `vector_stepN`.
fn steps(sidecar: &Sidecar) -> impl Iterator<Item = (u64, &str)> {
    let mut steps: Vec<_> = sidecar
        .files
        .keys()
        .filter_map(|key| Some((key.strip_prefix("vector_step")?.parse().ok()?, key.as_str())))
        .filter(|&(step, _): &(u64, &str)| step > 1)
        .collect();
    steps.sort_unstable();
    steps.into_iter()
}
