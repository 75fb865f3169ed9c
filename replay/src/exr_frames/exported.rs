//! What an exported side-car says beyond the common fields, and reading its frames back.
//!
//! [`Exported`] holds the declared conventions by the names that the protocol gives them, the
//! exact times, and a table of planes with the channels they stand in. With it, reading gives the
//! planes bit for bit; without it, the images are still ordinary EXR files.

use anyhow::{Context as _, bail, ensure};
use foreframe_protocol::{
    Camera, CameraMotion, ColorFormat, DepthConvention, DepthFormat, DepthMeaning, MaskFormat,
    MotionConvention, MotionDirection, MotionFormat, MotionUnit, PlaneKind, Primaries, Rect,
    StreamFormat, Transfer, ValidRectUse,
};
use foreframed::capture::{PlaneInfo, pixel_layout};
use serde::{Deserialize, Serialize};

use super::image::ExrImage;
use super::srgb;

/// What only a capture of this program knows of a frame.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Exported {
    /// Declared conventions of the stream.
    pub format: FormatText,
    /// Sequence number that the application counted up.
    pub key_index: u64,
    /// Simulation time that the frame shows, nanoseconds.
    pub content_time_ns: u64,
    /// When it arrived, nanoseconds of the monotonic clock.
    pub arrived_at_ns: u64,
    /// Content time that the first motion plane points back to.
    pub motion_from_ns: Option<u64>,
    /// View and projection at that time, column-major.
    pub motion_from_camera: Option<[[f32; 16]; 2]>,
    /// The planes, colour first.
    pub planes: Vec<PlaneText>,
}

/// A stream's conventions by name.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct FormatText {
    /// How colour is stored.
    pub color: String,
    /// How colour is encoded.
    pub transfer: String,
    /// Chromaticities of colour.
    pub primaries: String,
    /// Luminance of (1, 1, 1); 0 where it is not stated.
    pub white_cd_m2: f32,
    /// How a smaller valid rectangle is shown.
    pub valid_rect_use: String,
    /// Format and meaning of depth.
    pub depth: Option<[String; 2]>,
    /// Format, direction, unit and camera motion of vectors, and their scale.
    pub motion: Option<MotionText>,
    /// How the user interface is stored.
    pub ui: Option<String>,
    /// How the mask is stored.
    pub mask: Option<String>,
    /// Display that the picture is for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub display_profile: Option<String>,
}

/// A motion convention by name.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct MotionText {
    /// How it is stored.
    pub format: String,
    /// Which way it points.
    pub direction: String,
    /// What one unit is.
    pub unit: String,
    /// Whether the camera's motion is included.
    pub camera_motion: String,
    /// Factors on x and y after the unit.
    pub scale: [f32; 2],
}

/// One plane.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct PlaneText {
    /// What it shows.
    pub kind: String,
    /// Which one of its kind.
    pub which: u8,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The part that holds the image: x, y, width, height.
    pub valid: [u32; 4],
    /// Sub-pixel offset of the samples.
    pub jitter: [f32; 2],
    /// Content time that motion points back to.
    pub motion_from_ns: Option<u64>,
}

/// Finds a value of a closed set by its name.
macro_rules! named {
    ($type:ty, $name:expr) => {{
        let name: &str = $name;
        let found = <$type>::ALL.iter().copied().find(|value| value.name() == name);
        found.with_context(|| {
            let known: Vec<_> = <$type>::ALL.iter().map(|value| value.name()).collect();
            format!("expected one of {}, found `{name}`", known.join(", "))
        })
    }};
}

impl FormatText {
    /// The names of a format.
    #[must_use]
    pub fn new(format: &StreamFormat) -> Self {
        Self {
            color: format.color.name().to_owned(),
            transfer: format.transfer.name().to_owned(),
            primaries: format.primaries.name().to_owned(),
            white_cd_m2: format.white_cd_m2,
            valid_rect_use: format.valid_rect_use.name().to_owned(),
            depth: format
                .depth
                .map(|depth| [depth.format.name(), depth.meaning.name()].map(str::to_owned)),
            motion: format.motion.map(|motion| MotionText {
                format: motion.format.name().to_owned(),
                direction: motion.direction.name().to_owned(),
                unit: motion.unit.name().to_owned(),
                camera_motion: motion.camera_motion.name().to_owned(),
                scale: motion.scale,
            }),
            ui: format.ui.map(|ui| ui.name().to_owned()),
            mask: format.mask.map(|mask| mask.name().to_owned()),
            display_profile: format.display_profile.map(|name| name.to_string()),
        }
    }

    /// The format of these names.
    ///
    /// # Errors
    /// If a name is unknown.
    pub fn parse(&self, width: u32, height: u32) -> anyhow::Result<StreamFormat> {
        let depth = match &self.depth {
            None => None,
            Some([format, meaning]) => Some(DepthConvention {
                format: named!(DepthFormat, format)?,
                meaning: named!(DepthMeaning, meaning)?,
            }),
        };
        let motion = match &self.motion {
            None => None,
            Some(text) => Some(MotionConvention {
                format: named!(MotionFormat, &text.format)?,
                direction: named!(MotionDirection, &text.direction)?,
                unit: named!(MotionUnit, &text.unit)?,
                scale: text.scale,
                camera_motion: named!(CameraMotion, &text.camera_motion)?,
            }),
        };
        Ok(StreamFormat {
            width,
            height,
            color: named!(ColorFormat, &self.color)?,
            transfer: named!(Transfer, &self.transfer)?,
            primaries: named!(Primaries, &self.primaries)?,
            white_cd_m2: self.white_cd_m2,
            valid_rect_use: named!(ValidRectUse, &self.valid_rect_use)?,
            depth,
            motion,
            ui: self.ui.as_deref().map(|name| named!(ColorFormat, name)).transpose()?,
            mask: self.mask.as_deref().map(|name| named!(MaskFormat, name)).transpose()?,
            display_profile: self.display_profile.as_deref().map(str::parse).transpose()?,
        })
    }
}

impl Exported {
    /// Camera at the time that the first motion plane points back to.
    #[must_use]
    pub fn motion_from_camera(&self) -> Option<Camera> {
        self.motion_from_camera.map(|[view, projection]| Camera { view, projection })
    }
}

impl PlaneText {
    /// The names of a plane.
    #[must_use]
    pub fn new(info: &PlaneInfo) -> Self {
        let Rect { x, y, width, height } = info.valid;
        Self {
            kind: info.kind.name().to_owned(),
            which: info.which,
            width: info.width,
            height: info.height,
            valid: [x, y, width, height],
            jitter: info.jitter,
            motion_from_ns: info.motion_from_ns,
        }
    }

    /// The plane of these names in a stream of this format.
    ///
    /// # Errors
    /// If the kind is unknown or the stream does not declare it.
    pub fn parse(&self, format: &StreamFormat) -> anyhow::Result<PlaneInfo> {
        let kind = named!(PlaneKind, &self.kind)?;
        let Some(layout) = pixel_layout(format, kind) else {
            bail!("expected planes that the format declares, found {kind}");
        };
        let [x, y, width, height] = self.valid;
        Ok(PlaneInfo {
            kind,
            which: self.which,
            layout,
            width: self.width,
            height: self.height,
            valid: Rect { x, y, width, height },
            jitter: self.jitter,
            motion_from_ns: self.motion_from_ns,
        })
    }
}

/// How the bytes of a plane become channels of an image.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Samples {
    /// 8-bit sRGB levels as linear halves; alpha as it is.
    SrgbLevels,
    /// Halves, bit for bit.
    Halves,
    /// Floats, bit for bit.
    Floats,
    /// 32-bit words, bit for bit.
    Words,
    /// 16-bit words.
    ShortWords,
    /// Bytes.
    Bytes,
}

/// Channels that a plane of `format` stands in, and how.
#[must_use]
pub fn channels(format: &StreamFormat, info: &PlaneInfo) -> (Vec<String>, Samples) {
    let color = |color: ColorFormat, prefix: &str| match color {
        ColorFormat::Rgba8 => (rgba(prefix), Samples::SrgbLevels),
        ColorFormat::Rgba16f => (rgba(prefix), Samples::Halves),
        // One packed word: no program would take it for a colour.
        ColorFormat::Rgb10a2 => (vec![format!("{prefix}rgb10a2")], Samples::Words),
    };
    let nth = if info.which == 0 { String::new() } else { info.which.to_string() };
    match info.kind {
        PlaneKind::Color => color(format.color, ""),
        PlaneKind::Ui => color(format.ui.unwrap_or(ColorFormat::Rgba8), "ui."),
        PlaneKind::Mask => (vec!["mask.class".to_owned()], Samples::Bytes),
        PlaneKind::Depth => {
            // `Z` means distance to every program; a depth-buffer value is called otherwise.
            let is_distance =
                format.depth.is_none_or(|depth| depth.meaning == DepthMeaning::LinearView);
            let samples = match format.depth.map(|depth| depth.format) {
                Some(DepthFormat::F16) => Samples::Halves,
                Some(DepthFormat::U16) => Samples::ShortWords,
                Some(DepthFormat::U24) => Samples::Words,
                Some(DepthFormat::F32) | None => Samples::Floats,
            };
            (vec![if is_distance { "Z" } else { "depth" }.to_owned()], samples)
        }
        PlaneKind::Motion => {
            let samples = match format.motion.map(|motion| motion.format) {
                Some(MotionFormat::Rg32f) => Samples::Floats,
                Some(MotionFormat::Rg16f) | None => Samples::Halves,
            };
            (["u", "v"].map(|axis| format!("backward{nth}.{axis}")).to_vec(), samples)
        }
    }
}

fn rgba(prefix: &str) -> Vec<String> {
    ["R", "G", "B", "A"].map(|channel| format!("{prefix}{channel}")).to_vec()
}

/// Reads the bytes of a plane out of an exported image.
///
/// # Errors
/// If a channel is missing, or has another type or size than the plane.
pub fn read_plane(
    image: &ExrImage,
    format: &StreamFormat,
    info: &PlaneInfo,
) -> anyhow::Result<Vec<u8>> {
    let (names, samples) = channels(format, info);
    let element = match samples {
        Samples::SrgbLevels | Samples::Bytes => 1,
        Samples::Halves | Samples::ShortWords => 2,
        Samples::Floats | Samples::Words => 4,
    };
    let pixel_bytes = info.layout.pixel_bytes();
    let pixels = info.width as usize * info.height as usize;
    let mut bytes = vec![0; pixels * pixel_bytes];
    for (index, name) in names.iter().enumerate() {
        let [channel] = image.channels([name.as_str()])?;
        ensure!(
            (channel.width, channel.height) == (info.width, info.height),
            "expected a channel `{name}` of {}x{}, found {}x{}",
            info.width,
            info.height,
            channel.width,
            channel.height
        );
        let mut put = |pixel: usize, value: &[u8]| {
            bytes[pixel * pixel_bytes + index * element..][..element].copy_from_slice(value);
        };
        match samples {
            Samples::SrgbLevels => {
                for (pixel, &value) in channel.halves(name)?.iter().enumerate() {
                    let level = if index == 3 {
                        srgb::level_from_unit(value)
                    } else {
                        srgb::level_from_linear(value)
                    };
                    put(pixel, &[level]);
                }
            }
            Samples::Halves => {
                for (pixel, value) in channel.halves(name)?.iter().enumerate() {
                    put(pixel, &value.to_bits().to_le_bytes());
                }
            }
            Samples::Floats => {
                for (pixel, value) in channel.floats(name)?.iter().enumerate() {
                    put(pixel, &value.to_bits().to_le_bytes());
                }
            }
            Samples::Words | Samples::ShortWords | Samples::Bytes => {
                for (pixel, value) in channel.integers(name)?.iter().enumerate() {
                    let word = value.to_le_bytes();
                    ensure!(
                        word[element..].iter().all(|&byte| byte == 0),
                        "expected `{name}` in {element} bytes, found {value}"
                    );
                    put(pixel, &word[..element]);
                }
            }
        }
    }
    Ok(bytes)
}
