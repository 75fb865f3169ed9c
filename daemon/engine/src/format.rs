//! What a stream declares about its planes. [`crate::decode`] is the only reader.
//!
//! Engines differ in every one of these conventions, so the application states its own and the
//! decode step converts, once. Inside the engine only one convention exists.

pub use crate::color::ColorFormat;

/// Encoding of the colour values. Filtering is done on encoded values in each case.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Transfer {
    /// IEC 61966-2-1.
    #[default]
    Srgb,
    /// SMPTE ST 2084.
    Pq,
    /// Scene-linear light.
    Linear,
}

/// Chromaticities of the colour values.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Primaries {
    /// ITU-R BT.709.
    #[default]
    Bt709,
    /// ITU-R BT.2020.
    Bt2020,
    /// Display P3 (D65).
    DisplayP3,
}

/// How a depth plane is stored.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DepthFormat {
    /// 32-bit float.
    F32,
    /// 16-bit float.
    F16,
    /// 16-bit unsigned, normalised to 0..1.
    U16,
    /// 24-bit unsigned in the low bits of a 32-bit word, normalised to 0..1. The top byte is
    /// ignored.
    U24,
}

impl DepthFormat {
    /// Bytes of one pixel.
    #[must_use]
    pub const fn bytes_per_pixel(self) -> u32 {
        match self {
            Self::F32 | Self::U24 => 4,
            Self::F16 | Self::U16 => 2,
        }
    }
}

/// What the stored number means.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DepthMeaning {
    /// Depth-buffer value, 0 at the near plane, 1 at the far plane (which may be at infinity).
    Standard,
    /// Depth-buffer value, 1 at the near plane, 0 at the far plane (which may be at infinity).
    Reversed,
    /// Distance along the view axis, positive, in world units.
    LinearView,
}

/// A stream's depth planes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DepthConvention {
    /// How it is stored.
    pub format: DepthFormat,
    /// What it means. Where a camera is present and its projection contradicts this, the
    /// projection wins, and the key report says so.
    pub meaning: DepthMeaning,
}

/// How a motion plane is stored: two channels, x then y.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MotionFormat {
    /// Two 16-bit floats.
    Rg16f,
    /// Two 32-bit floats.
    Rg32f,
}

impl MotionFormat {
    /// Bytes of one pixel.
    #[must_use]
    pub const fn bytes_per_pixel(self) -> u32 {
        match self {
            Self::Rg16f => 4,
            Self::Rg32f => 8,
        }
    }
}

/// Which way a motion vector points.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MotionDirection {
    /// Position in the previous frame minus position in the current one (FSR, XeSS, DLSS).
    CurrentToPrevious,
    /// Position in the current frame minus position in the previous one.
    PreviousToCurrent,
}

/// What one unit of a motion vector is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MotionUnit {
    /// Pixels of the colour plane's valid rectangle.
    Pixels,
    /// Fractions of the image: 1 is its whole width or height, y down.
    Uv,
    /// Clip space: 2 is the whole width or height, y up.
    Ndc,
}

/// Whether the motion of the camera is in the vectors.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum CameraMotion {
    /// Vectors hold camera and object motion.
    Included,
    /// Vectors hold object motion only; decode adds the camera's from depth and matrices.
    Missing,
}

/// A stream's motion planes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MotionConvention {
    /// How it is stored.
    pub format: MotionFormat,
    /// Which way it points.
    pub direction: MotionDirection,
    /// What one unit is.
    pub unit: MotionUnit,
    /// Factors on x and y after the unit; a negative sign flips the axis. Finite, not 0.
    pub scale: [f32; 2],
    /// Whether the camera's motion is included.
    pub camera_motion: CameraMotion,
}

/// How a colour plane whose valid rectangle is smaller than itself is shown.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum ValidRectUse {
    /// Bars: pixels outside are shown as they are and never warped.
    #[default]
    Letterbox,
    /// Dynamic resolution: the rectangle is stretched to the whole output.
    Stretch,
    /// Temporal resolution multiplexing ([`crate::multiplex`]): a key whose rectangle is smaller is
    /// a reduced one, and those that take turns with such keys make up for what it lacks.
    Multiplex,
}

/// Everything that stays the same for all key frames of a stream.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct StreamFormat {
    /// Columns of the colour plane and of the output, 1 to 8192.
    pub width: u32,
    /// Rows of the colour plane and of the output, 1 to 8192.
    pub height: u32,
    /// How colour is stored.
    pub color: ColorFormat,
    /// How colour is encoded.
    pub transfer: Transfer,
    /// Chromaticities of colour.
    pub primaries: Primaries,
    /// Luminance of (1, 1, 1) in cd/m2, where it matters; 0 where it is not stated.
    pub white_cd_m2: f32,
    /// How a smaller valid rectangle of colour is shown.
    pub valid_rect_use: ValidRectUse,
    /// Depth planes, if the stream has any.
    pub depth: Option<DepthConvention>,
    /// Motion planes, if the stream has any.
    pub motion: Option<MotionConvention>,
}

impl StreamFormat {
    /// Largest width and height of a colour plane.
    pub const MAX_SIZE: u32 = 8192;

    /// An sRGB `rgba8` stream of colour alone.
    #[must_use]
    pub fn rgba8(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            color: ColorFormat::Rgba8,
            transfer: Transfer::Srgb,
            primaries: Primaries::Bt709,
            white_cd_m2: 0.0,
            valid_rect_use: ValidRectUse::Letterbox,
            depth: None,
            motion: None,
        }
    }
}
