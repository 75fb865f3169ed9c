//! What a stream declares. Nothing is converted here: state the conventions that your renderer
//! has, and the daemon converts.

use foreframe_protocol::limits::DEFAULT_SLOTS;
use foreframe_protocol::{
    CameraMotion, ColorFormat, CreateStream, DepthConvention, DepthFormat, DepthMeaning,
    MaskFormat, MotionConvention, MotionDirection, MotionFormat, MotionUnit, PlaneKind, PlaneMap,
    PlaneSize, Primaries, ProfileName, StreamFormat, Transfer, ValidRectUse,
};

use crate::error::{Error, Result};

/// Depth planes of a stream.
#[derive(Clone, Copy, PartialEq, Debug)]
#[must_use]
pub struct Depth {
    convention: DepthConvention,
    ratio: f64,
}

impl Depth {
    /// Depth planes of this format and meaning, as large as colour.
    pub fn new(format: DepthFormat, meaning: DepthMeaning) -> Self {
        Self { convention: DepthConvention { format, meaning }, ratio: 1.0 }
    }

    /// Colour is this much larger per axis, 1 to 4; 2 is a good choice.
    pub fn ratio(mut self, ratio: f64) -> Self {
        self.ratio = ratio;
        self
    }
}

/// Motion planes of a stream.
#[derive(Clone, Copy, PartialEq, Debug)]
#[must_use]
pub struct Motion {
    convention: MotionConvention,
    ratio: f64,
}

impl Motion {
    /// Motion planes of this format, as large as colour, in pixels from the current to the
    /// previous position, camera motion included.
    pub fn new(format: MotionFormat) -> Self {
        let convention = MotionConvention {
            format,
            direction: MotionDirection::CurrentToPrevious,
            unit: MotionUnit::Pixels,
            scale: [1.0; 2],
            camera_motion: CameraMotion::Included,
        };
        Self { convention, ratio: 1.0 }
    }

    /// Which way the vectors point.
    pub fn direction(mut self, direction: MotionDirection) -> Self {
        self.convention.direction = direction;
        self
    }

    /// What one unit is.
    pub fn unit(mut self, unit: MotionUnit) -> Self {
        self.convention.unit = unit;
        self
    }

    /// Factors on x and y after the unit; a negative sign flips the axis.
    pub fn scale(mut self, scale: [f32; 2]) -> Self {
        self.convention.scale = scale;
        self
    }

    /// Whether the vectors hold the camera's motion. If not, each key frame has to bring depth and
    /// both cameras.
    pub fn camera_motion(mut self, camera_motion: CameraMotion) -> Self {
        self.convention.camera_motion = camera_motion;
        self
    }

    /// Colour is this much larger per axis, 1 to 4; 2 is a good choice.
    pub fn ratio(mut self, ratio: f64) -> Self {
        self.ratio = ratio;
        self
    }
}

/// Everything that stays the same for all key frames of a stream.
#[derive(Clone, Copy, PartialEq, Debug)]
#[must_use]
pub struct StreamOptions {
    format: StreamFormat,
    depth_ratio: f64,
    motion_ratio: f64,
    mask_ratio: f64,
    ui_size: PlaneSize,
    slots: u32,
    row_align: u32,
}

impl StreamOptions {
    /// A stream of sRGB `rgba8` colour alone.
    pub fn rgba8(width: u32, height: u32) -> Self {
        Self {
            format: StreamFormat::rgba8(width, height),
            depth_ratio: 1.0,
            motion_ratio: 1.0,
            mask_ratio: 1.0,
            ui_size: PlaneSize { width, height },
            slots: DEFAULT_SLOTS,
            row_align: 1,
        }
    }

    /// How colour is stored and encoded.
    pub fn color(mut self, format: ColorFormat, transfer: Transfer, primaries: Primaries) -> Self {
        self.format.color = format;
        self.format.transfer = transfer;
        self.format.primaries = primaries;
        self
    }

    /// Luminance of (1, 1, 1) in cd/m2.
    pub fn white_cd_m2(mut self, white_cd_m2: f32) -> Self {
        self.format.white_cd_m2 = white_cd_m2;
        self
    }

    /// How a smaller valid rectangle of colour is shown.
    pub fn valid_rect_use(mut self, valid_rect_use: ValidRectUse) -> Self {
        self.format.valid_rect_use = valid_rect_use;
        self
    }

    /// Adds depth planes.
    pub fn depth(mut self, depth: Depth) -> Self {
        self.format.depth = Some(depth.convention);
        self.depth_ratio = depth.ratio;
        self
    }

    /// Adds motion planes.
    pub fn motion(mut self, motion: Motion) -> Self {
        self.format.motion = Some(motion.convention);
        self.motion_ratio = motion.ratio;
        self
    }

    /// Adds premultiplied user-interface planes of up to this size, with the format of colour: with
    /// key frames, or by themselves ([`Client::acquire_ui`](crate::Client::acquire_ui)), for which
    /// a slot more is good.
    pub fn ui(mut self, format: ColorFormat, width: u32, height: u32) -> Self {
        self.format.ui = Some(format);
        self.ui_size = PlaneSize { width, height };
        self
    }

    /// Adds mask planes, one byte per pixel, the code of its [`MaskClass`](crate::MaskClass): where
    /// motion vectors do not tell how colour moves on. Colour is `ratio` larger per axis.
    pub fn mask(mut self, ratio: f64) -> Self {
        self.format.mask = Some(MaskFormat::Class8);
        self.mask_ratio = ratio;
        self
    }

    /// The display that the picture is for, by the name of a profile that the daemon knows: a
    /// built-in one (`foreframe perception displays`) or one of its user. It takes the place of the
    /// daemon's `--profile`. A name that the daemon does not know ends the stream with an error
    /// ([`ErrorCode::Unsupported`](crate::ErrorCode::Unsupported)) that lists as many as fit of those
    /// it knows.
    pub fn display_profile(mut self, name: ProfileName) -> Self {
        self.format.display_profile = Some(name);
        self
    }

    /// Key frames that can be under way at once, 1 to 8; 3 unless stated.
    pub fn slots(mut self, slots: u32) -> Self {
        self.slots = slots;
        self
    }

    /// Every row starts at a multiple of this many bytes (a power of two, 1 to 4096), as some
    /// read-backs need it.
    pub fn row_align(mut self, row_align: u32) -> Self {
        self.row_align = row_align;
        self
    }

    pub(crate) fn row_alignment(&self) -> Result<u32> {
        let row_align = self.row_align;
        if row_align.is_power_of_two() && row_align <= 4096 {
            return Ok(row_align);
        }
        let expected = "a power of two, 1 to 4096".to_owned();
        Err(Error::Option { option: "row_align", expected, found: row_align.to_string() })
    }

    /// The message that declares such a stream under this number: what a capture writer records.
    #[must_use]
    pub fn to_message(self, stream: u32) -> CreateStream {
        let max_sizes = PlaneMap::from_fn(|kind| {
            self.format.bytes_per_pixel(kind)?;
            Some(match kind {
                PlaneKind::Color => self.reduced(1.0),
                PlaneKind::Depth => self.reduced(self.depth_ratio),
                PlaneKind::Motion => self.reduced(self.motion_ratio),
                PlaneKind::Mask => self.reduced(self.mask_ratio),
                PlaneKind::Ui => self.ui_size,
            })
        });
        CreateStream { stream, format: self.format, max_sizes, slots: self.slots }
    }

    /// Colour's size over `ratio`, to the nearest pixel. A ratio that is no number gives 0, which
    /// the check of the message refuses.
    fn reduced(&self, ratio: f64) -> PlaneSize {
        #[expect(clippy::cast_possible_truncation, reason = "float to int casts saturate")]
        #[expect(clippy::cast_sign_loss, reason = "float to int casts saturate")]
        let over = |size: u32| (f64::from(size) / ratio).round() as u32;
        PlaneSize { width: over(self.format.width), height: over(self.format.height) }
    }
}
