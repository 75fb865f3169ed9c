//! Key frames: as they arrive ([`KeyInput`]) and as the engine keeps them ([`KeyFrame`]).

use zerocopy::{FromBytes, Immutable, IntoBytes};

use crate::color::ColorPlane;
use crate::plane::{Plane, Rect};
use crate::time::{MonoSpan, MonoTime};

/// View and projection of one key frame, unjittered, column-major, clip = projection * view * p.
/// Every element is finite once decoded.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Camera {
    /// World to view.
    pub view: [f32; 16],
    /// View to clip.
    pub projection: [f32; 16],
}

/// Where the pixels of a plane are.
#[derive(Clone, Copy, Debug)]
pub enum Pixels<'a> {
    /// In bytes that stay as they are.
    Bytes(&'a [u8]),
    /// In memory that somebody else may write to meanwhile.
    Reader(&'a dyn ReadPixels),
}

/// Reads pixels out of memory that may change: every byte that is used is copied before.
///
/// The engine reads rows on several threads at once; a row of a plane that is coarser than the
/// field grid once per row of the grid, and depth twice where the camera's motion is worked out.
pub trait ReadPixels: Sync + std::fmt::Debug {
    /// Bytes from the first pixel to the end of the last.
    fn byte_count(&self) -> u64;

    /// Copies bytes from `offset` on, all of them before the end.
    fn read(&self, offset: u64, out: &mut [u8]);
}

impl Pixels<'_> {
    /// Bytes from the first pixel to the end of the last.
    #[must_use]
    pub fn byte_count(&self) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes.len() as u64,
            Self::Reader(reader) => reader.byte_count(),
        }
    }
}

impl<'a> From<&'a [u8]> for Pixels<'a> {
    fn from(bytes: &'a [u8]) -> Self {
        Self::Bytes(bytes)
    }
}

/// One plane of a key frame, in the declared format.
#[derive(Clone, Copy, Debug)]
pub struct PlaneInput<'a> {
    /// Pixels; row `y` starts at byte `y * stride`.
    pub pixels: Pixels<'a>,
    /// Columns of the plane.
    pub width: u32,
    /// Rows of the plane.
    pub height: u32,
    /// Bytes from one row to the next, at least `width` pixels.
    pub stride: u32,
    /// The part that holds the image.
    pub valid: Rect,
    /// Sub-pixel offset of the samples, in pixels of this plane, x right, y down: a sample of pixel
    /// centre c shows the unjittered image at c + jitter.
    pub jitter: [f32; 2],
}

impl<'a> PlaneInput<'a> {
    /// A plane of this size (columns, rows) without padding or jitter, all of it image.
    #[must_use]
    pub fn packed(bytes: &'a [u8], [width, height]: [u32; 2], bytes_per_pixel: u32) -> Self {
        Self {
            pixels: Pixels::Bytes(bytes),
            width,
            height,
            stride: width * bytes_per_pixel,
            valid: Rect::full(width, height),
            jitter: [0.0; 2],
        }
    }
}

/// A key frame as it arrives: borrowed planes in the stream's declared conventions.
#[derive(Clone, Copy, Debug)]
pub struct KeyInput<'a> {
    /// Sequence number that the application counts up.
    pub index: u64,
    /// Simulation time that the picture shows.
    pub content_time: MonoTime,
    /// Content time that the motion plane points back to, whether or not that frame was submitted.
    pub motion_from: Option<MonoTime>,
    /// The application says that nothing before this key relates to it.
    pub is_cut: bool,
    /// Colour.
    pub color: PlaneInput<'a>,
    /// Depth, if this key has it.
    pub depth: Option<PlaneInput<'a>>,
    /// Motion, if this key has it.
    pub motion: Option<PlaneInput<'a>>,
    /// One class per pixel ([`crate::mask`]), a byte each, if this key has them.
    pub mask: Option<PlaneInput<'a>>,
    /// Camera at `content_time`.
    pub camera: Option<Camera>,
    /// Camera at `motion_from`; needed where vectors lack the camera's motion.
    pub motion_from_camera: Option<Camera>,
}

/// Velocity of one surface point, in 1/32 pixel of the colour plane per motion span: position at
/// the key minus position at `motion_from`. [`Velocity::UNTRACKABLE`] holds no velocity.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, FromBytes, IntoBytes, Immutable)]
#[repr(C, align(4))]
pub struct Velocity {
    /// To the right.
    pub x: i16,
    /// Down.
    pub y: i16,
}

impl Velocity {
    /// Steps per pixel.
    pub const PER_PX: i32 = 32;
    /// No velocity is known (NaN, or beyond +-1023 pixels): the surface is held.
    pub const UNTRACKABLE: Self = Self { x: i16::MIN, y: i16::MIN };

    /// Whether it holds a velocity.
    #[must_use]
    pub fn is_trackable(self) -> bool {
        self != Self::UNTRACKABLE
    }
}

/// Acceleration of one surface point, in 1/32 pixel of the colour plane per motion span squared:
/// after phase p it has moved by v p + a p^2 / 2.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, IntoBytes, Immutable)]
#[repr(C)]
pub struct Acceleration {
    /// To the right.
    pub x: i16,
    /// Down.
    pub y: i16,
}

/// A key frame in the one convention of the engine.
///
/// All planes of the field that are present have the same size: the field grid. Its cells share
/// `valid` out evenly; [`crate::field::FieldMap`] is the one definition of where a cell lies.
#[derive(Clone, Debug, Default)]
pub struct KeyFrame {
    /// Sequence number that the application counts up.
    pub index: u64,
    /// Simulation time that the picture shows.
    pub content_time: MonoTime,
    /// Content time that `velocity` points back to. None where there is no usable motion.
    pub motion_from: Option<MonoTime>,
    /// Nothing before this key relates to it.
    pub is_cut: bool,
    /// The same, as its picture has shown ([`crate::evidence`]), although nobody declared it.
    pub is_found_cut: bool,
    /// Colour, at the size of the output.
    pub color: ColorPlane,
    /// What is compared with the keys before and after where `color` alternates with them
    /// ([`crate::multiplex`]); empty where it is `color`.
    pub steady: ColorPlane,
    /// The part of `color` that moves; the rest is shown as it is.
    pub valid: Rect,
    /// Depth key per cell of the field grid, larger is nearer. Empty without a depth plane.
    pub depth: Plane<u32>,
    /// Code of the class of each cell of the field grid. Empty without a mask plane.
    pub mask: Plane<u8>,
    /// 1 / distance along the view axis of a depth key of 1, where that is known.
    pub inverse_distance_per_depth_key: Option<f32>,
    /// Dilated, quantised motion per cell of the field grid. Empty without a motion plane.
    pub velocity: Plane<Velocity>,
    /// `velocity` as it was decoded, where a method has put other trajectories in its place: how
    /// far surfaces came since `motion_from`. Empty where `velocity` is still that.
    pub came: Plane<Velocity>,
    /// Acceleration that goes with `velocity`. Empty where nothing accelerates.
    pub acceleration: Plane<Acceleration>,
    /// Motion per cell as decoded, neither dilated nor rounded: newer minus older position, pixels
    /// of the colour plane, NaN where unknown. Kept by methods whose trajectories are worked out
    /// from it; empty otherwise.
    pub displacement: Plane<[f32; 2]>,
    /// Jitter of the field against the colour, Q8 pixels of the colour plane: how far right and
    /// down of its even place each cell lies. 0 without jitter.
    pub field_offset: [i32; 2],
    /// Camera at `content_time`.
    pub camera: Option<Camera>,
    /// Camera at the content time that the motion plane points back to.
    pub motion_from_camera: Option<Camera>,
}

impl KeyFrame {
    /// The picture that other keys of the stream are compared with.
    #[must_use]
    pub fn compared(&self) -> &ColorPlane {
        if self.steady.width() == 0 { &self.color } else { &self.steady }
    }

    /// Time that the motion field spans; None where there is no usable motion.
    #[must_use]
    pub fn motion_span(&self) -> Option<MonoSpan> {
        let span = self.content_time - self.motion_from?;
        (span > MonoSpan::ZERO).then_some(span)
    }
}
