//! What a stream declares about its planes, once, for all its key frames.
//!
//! Engines differ in every one of these conventions, so the application states its own; nothing is
//! converted on the way. Names and meaning are those of the engine's own format types.

use crate::limits::{MAX_MOTION_SCALE, MAX_SIZE, MAX_WHITE_CD_M2};
use crate::plane::{PlaneKind, PlaneMap, PlaneSize};
use crate::profile::ProfileName;

wire_enum! {
    /// How the channels of a colour plane are stored.
    ColorFormat {
        /// Four bytes: red, green, blue, alpha in memory order.
        Rgba8 = 1 "rgba8",
        /// One little-endian word: red in bits 0..10, green 10..20, blue 20..30, alpha 30..32.
        Rgb10a2 = 2 "rgb10a2",
        /// Four little-endian half floats: red, green, blue, alpha in memory order.
        Rgba16f = 3 "rgba16f",
    }
}

wire_enum! {
    /// Encoding of the colour values.
    Transfer {
        /// IEC 61966-2-1.
        Srgb = 1 "srgb",
        /// SMPTE ST 2084.
        Pq = 2 "pq",
        /// Scene-linear light.
        Linear = 3 "linear",
    }
}

wire_enum! {
    /// Chromaticities of the colour values.
    Primaries {
        /// ITU-R BT.709.
        Bt709 = 1 "bt709",
        /// ITU-R BT.2020.
        Bt2020 = 2 "bt2020",
        /// Display P3 (D65).
        DisplayP3 = 3 "display_p3",
    }
}

wire_enum! {
    /// How a colour plane whose valid rectangle is smaller than itself is shown.
    ValidRectUse {
        /// Bars: pixels outside are shown as they are and never warped.
        Letterbox = 1 "letterbox",
        /// Dynamic resolution: the rectangle is stretched to the whole output.
        Stretch = 2 "stretch",
        /// Temporal resolution multiplexing: a smaller rectangle is a reduced picture, stretched,
        /// and the pictures in full that take turns with such make up for what they lack.
        Multiplex = 3 "multiplex",
    }
}

wire_enum! {
    /// How a depth plane is stored.
    DepthFormat {
        /// 32-bit float.
        F32 = 1 "f32",
        /// 16-bit float.
        F16 = 2 "f16",
        /// 16-bit unsigned, normalised to 0..1.
        U16 = 3 "u16",
        /// 24-bit unsigned in the low bits of a 32-bit word, normalised to 0..1.
        U24 = 4 "u24",
    }
}

wire_enum! {
    /// What a stored depth means.
    DepthMeaning {
        /// Depth-buffer value, 0 at the near plane, 1 at the far plane (which may be at infinity).
        Standard = 1 "standard",
        /// Depth-buffer value, 1 at the near plane, 0 at the far plane (which may be at infinity).
        Reversed = 2 "reversed",
        /// Distance along the view axis, positive, in world units.
        LinearView = 3 "linear_view",
    }
}

wire_enum! {
    /// How a motion plane is stored: two channels, x then y.
    MotionFormat {
        /// Two 16-bit floats.
        Rg16f = 1 "rg16f",
        /// Two 32-bit floats.
        Rg32f = 2 "rg32f",
    }
}

wire_enum! {
    /// Which way a motion vector points.
    MotionDirection {
        /// Position in the previous frame minus position in the current one (FSR, XeSS, DLSS).
        CurrentToPrevious = 1 "current_to_previous",
        /// Position in the current frame minus position in the previous one.
        PreviousToCurrent = 2 "previous_to_current",
    }
}

wire_enum! {
    /// What one unit of a motion vector is.
    MotionUnit {
        /// Pixels of the colour plane's valid rectangle.
        Pixels = 1 "pixels",
        /// Fractions of the image: 1 is its whole width or height, y down.
        Uv = 2 "uv",
        /// Clip space: 2 is the whole width or height, y up.
        Ndc = 3 "ndc",
    }
}

wire_enum! {
    /// Whether the motion of the camera is in the vectors.
    CameraMotion {
        /// Vectors hold camera and object motion.
        Included = 1 "included",
        /// Vectors hold object motion only.
        Missing = 2 "missing",
    }
}

wire_enum! {
    /// What a pixel of a mask plane says of the pixel's motion. Other codes count as opaque.
    MaskClass {
        /// A surface that its motion vector belongs to.
        Opaque = 0 "opaque",
        /// A second layer that lets a surface show through.
        Transparent = 1 "transparent",
        /// Sparks, smoke, rain.
        Particle = 2 "particle",
        /// A shadow that moves otherwise than the surface that it falls on.
        Shadow = 3 "shadow",
        /// What a surface mirrors.
        Reflection = 4 "reflection",
        /// A texture that moves on its surface: a screen, water, a scrolling sign.
        AnimatedTexture = 5 "animated_texture",
        /// A surface without a motion vector, or with one that means nothing.
        MotionInvalid = 6 "motion_invalid",
    }
}

wire_enum! {
    /// How a mask plane is stored.
    MaskFormat {
        /// One byte per pixel, the code of its [`MaskClass`].
        Class8 = 1 "class8",
    }
}

impl ColorFormat {
    /// Bytes of one pixel.
    #[must_use]
    pub const fn bytes_per_pixel(self) -> u32 {
        match self {
            Self::Rgba8 | Self::Rgb10a2 => 4,
            Self::Rgba16f => 8,
        }
    }
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

/// A stream's depth planes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DepthConvention {
    /// How it is stored.
    pub format: DepthFormat,
    /// What it means. A projection matrix that says otherwise wins.
    pub meaning: DepthMeaning,
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
    /// Premultiplied user interface, composited last, if the stream has any.
    pub ui: Option<ColorFormat>,
    /// One class per pixel, if the stream has any.
    pub mask: Option<MaskFormat>,
    /// Display that the picture is for, if the client knows it better than the daemon. It wins over
    /// the daemon's own; a name that the daemon does not know ends the stream.
    pub display_profile: Option<ProfileName>,
}

impl StreamFormat {
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
            ui: None,
            mask: None,
            display_profile: None,
        }
    }

    /// Bytes of one pixel of a plane; None where the stream has no such plane.
    #[must_use]
    pub fn bytes_per_pixel(&self, kind: PlaneKind) -> Option<u32> {
        match kind {
            PlaneKind::Color => Some(self.color.bytes_per_pixel()),
            PlaneKind::Depth => self.depth.map(|depth| depth.format.bytes_per_pixel()),
            PlaneKind::Motion => self.motion.map(|motion| motion.format.bytes_per_pixel()),
            PlaneKind::Ui => self.ui.map(ColorFormat::bytes_per_pixel),
            PlaneKind::Mask => self.mask.map(|MaskFormat::Class8| 1),
        }
    }

    /// The largest planes that this stream can have: all that it declares, at the size of colour.
    #[must_use]
    pub fn full_sizes(&self) -> PlaneMap<PlaneSize> {
        let full = PlaneSize { width: self.width, height: self.height };
        PlaneMap::from_fn(|kind| self.bytes_per_pixel(kind).map(|_| full))
    }

    /// The first value that is out of range: field of the create-stream message, what it allows,
    /// what it holds. None where all is well.
    pub(crate) fn first_fault(&self) -> Option<(&'static str, String, String)> {
        let size = |value: u32| !(1..=MAX_SIZE).contains(&value);
        for (field, value) in [("width", self.width), ("height", self.height)] {
            if size(value) {
                return Some((field, format!("1 to {MAX_SIZE}"), value.to_string()));
            }
        }
        if !(0.0..=MAX_WHITE_CD_M2).contains(&self.white_cd_m2) {
            let expected = format!("0 (not stated) to {MAX_WHITE_CD_M2}");
            return Some(("white_cd_m2", expected, self.white_cd_m2.to_string()));
        }
        let scales = self.motion.map_or([1.0; 2], |motion| motion.scale);
        let bad_scale = scales
            .into_iter()
            .find(|scale| !(scale.abs() > 0.0 && scale.abs() <= MAX_MOTION_SCALE))?;
        let expected = format!("a number within +-{MAX_MOTION_SCALE}, not 0");
        Some(("motion_scale", expected, bad_scale.to_string()))
    }
}
