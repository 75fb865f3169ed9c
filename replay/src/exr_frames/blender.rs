//! Frames as Blender renders them: multi-layer names, vectors with y up, linear halves.
//!
//! - Colour `ViewLayer.Combined.{R,G,B}` is linear. Where its values lie on the 256 sRGB levels it
//!   becomes `rgba8`, exactly; else it stays `rgba16f`.
//! - Depth `ViewLayer.Depth.Z` is planar, along the view axis, positive.
//! - Motion `ViewLayer.Vector.{X,Y}` is previous minus current position, pixels, **y up**. It is
//!   kept bit for bit and declared as such. `Z` and `W` are the way to the *next* frame and are
//!   never read: no program that extrapolates could know them.
//! - Vectors at the clip value of the renderer are meaningless (the point was behind the camera)
//!   and become NaN: no motion is known. Background has zero vectors whatever the camera does; its
//!   true motion is put in from the cameras of the two frames ([`SkyMotion`]), or NaN where the
//!   earlier camera is not in the folder.

use anyhow::ensure;
use foreframe_protocol::{
    CameraMotion, ColorFormat, DepthConvention, DepthFormat, DepthMeaning, MotionConvention,
    MotionDirection, MotionFormat, MotionUnit, StreamFormat, Transfer,
};
use half::f16;

use super::image::ExrImage;
use super::sky::SkyMotion;
use super::srgb;

/// Depth that Blender writes where there is no geometry.
const BACKGROUND_DEPTH: f32 = 1e10;
/// Blender clips vectors to this many pixels.
const CLIPPED: f32 = 32768.0;
/// Alpha of frames that have none.
const OPAQUE: f16 = f16::ONE;

const COLOR: [&str; 3] = ["ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"];
const DEPTH: &str = "ViewLayer.Depth.Z";
const VECTOR: [&str; 2] = ["ViewLayer.Vector.X", "ViewLayer.Vector.Y"];

/// The format of an imported stream.
#[must_use]
pub fn stream_format(width: u32, height: u32, color: ColorFormat) -> StreamFormat {
    let transfer = if color == ColorFormat::Rgba16f { Transfer::Linear } else { Transfer::Srgb };
    StreamFormat {
        color,
        transfer,
        depth: Some(DepthConvention {
            format: DepthFormat::F32,
            meaning: DepthMeaning::LinearView,
        }),
        motion: Some(MotionConvention {
            format: MotionFormat::Rg16f,
            direction: MotionDirection::CurrentToPrevious,
            unit: MotionUnit::Pixels,
            scale: [1.0, -1.0],
            camera_motion: CameraMotion::Included,
        }),
        ..StreamFormat::rgba8(width, height)
    }
}

/// Whether an image has Blender's colour channels.
#[must_use]
pub fn is_color(image: &ExrImage) -> bool {
    image.channel(COLOR[0]).is_some()
}

fn expect_size(what: &str, found: (u32, u32), expected: (u32, u32)) -> anyhow::Result<()> {
    ensure!(
        found == expected,
        "{what}: expected {}x{} pixels as the side-car says, found {}x{}",
        expected.0,
        expected.1,
        found.0,
        found.1
    );
    Ok(())
}

/// Colour, before it is decided how to store it.
#[derive(Debug)]
pub struct LinearColor<'a> {
    channels: [&'a [f16]; 3],
}

impl<'a> LinearColor<'a> {
    /// The colour channels of an image.
    ///
    /// # Errors
    /// If they are missing or have another type or size.
    pub fn read(image: &'a ExrImage, size: (u32, u32)) -> anyhow::Result<Self> {
        let found = image.channels(COLOR)?;
        expect_size(COLOR[0], (found[0].width, found[0].height), size)?;
        let [r, g, b] = found;
        let channels = [r.halves(COLOR[0])?, g.halves(COLOR[1])?, b.halves(COLOR[2])?];
        Ok(Self { channels })
    }

    /// The first value that is not, to the precision of a half, one of the 256 sRGB levels.
    #[must_use]
    pub fn first_off_level(&self) -> Option<f16> {
        let is_level = |value: f16| {
            let level = srgb::linear_from_level(srgb::level_from_linear(value));
            level.to_bits().abs_diff(value.to_bits()) <= 1
        };
        self.channels.iter().flat_map(|channel| channel.iter()).copied().find(|&v| !is_level(v))
    }

    /// Pixels of a colour plane.
    #[must_use]
    pub fn pixels(&self, format: ColorFormat) -> Vec<u8> {
        let [r, g, b] = self.channels;
        let pixels = r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]);
        if format == ColorFormat::Rgba16f {
            pixels
                .flat_map(|[r, g, b]| [r, g, b, OPAQUE].map(|half| half.to_bits().to_le_bytes()))
                .flatten()
                .collect()
        } else {
            pixels
                .flat_map(|pixel| {
                    let [r, g, b] = pixel.map(srgb::level_from_linear);
                    [r, g, b, 255]
                })
                .collect()
        }
    }
}

/// Depth of an image; None where it has none.
///
/// # Errors
/// If the channel has another type or size.
pub fn depth(image: &ExrImage, size: (u32, u32)) -> anyhow::Result<Option<Vec<f32>>> {
    let Some(channel) = image.channel(DEPTH) else { return Ok(None) };
    expect_size(DEPTH, (channel.width, channel.height), size)?;
    channel.floats(DEPTH).map(Some)
}

/// Pixels of a depth plane.
#[must_use]
pub fn depth_pixels(depth: &[f32]) -> Vec<u8> {
    depth.iter().flat_map(|depth| depth.to_le_bytes()).collect()
}

/// Pixels of the motion plane in an image; None where it has none. `sky` is the motion of the
/// background, None where the earlier camera is unknown; `depth` tells where background is.
///
/// # Errors
/// If a channel has another type or size.
pub fn motion_pixels(
    image: &ExrImage,
    size: (u32, u32),
    depth: Option<&[f32]>,
    sky: Option<&SkyMotion>,
) -> anyhow::Result<Option<Vec<u8>>> {
    if image.channel(VECTOR[0]).is_none() {
        return Ok(None);
    }
    let [x, y] = image.channels(VECTOR)?;
    expect_size(VECTOR[0], (x.width, x.height), size)?;
    let (x, y) = (x.halves(VECTOR[0])?, y.halves(VECTOR[1])?);
    let width = size.0 as usize;
    let mut pixels = Vec::with_capacity(x.len() * 4);
    for (index, (&x, &y)) in x.iter().zip(y).enumerate() {
        let is_still = x.to_f32() == 0.0 && y.to_f32() == 0.0;
        let is_background = is_still && depth.is_some_and(|depth| depth[index] >= BACKGROUND_DEPTH);
        let vector = if is_background {
            let (column, row) = (index % width, index / width);
            #[expect(clippy::cast_possible_truncation, reason = "inside the image")]
            let motion = sky.and_then(|sky| sky.displacement(column as u32, row as u32));
            // y down becomes y up, as in the rest of the plane.
            motion.map_or([f16::NAN; 2], |[x, y]| [f16::from_f64(x), f16::from_f64(-y)])
        } else if x.to_f32().abs() >= CLIPPED || y.to_f32().abs() >= CLIPPED {
            [f16::NAN; 2]
        } else {
            [x, y]
        };
        pixels.extend(vector.iter().flat_map(|half| half.to_bits().to_le_bytes()));
    }
    Ok(Some(pixels))
}
