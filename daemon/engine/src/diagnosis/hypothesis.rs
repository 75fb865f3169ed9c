//! The ways in which a motion plane may have been meant.

use crate::format::{CameraMotion, StreamFormat};

/// A way of reading the motion plane.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Hypothesis {
    /// As the stream declares it.
    AsDeclared,
    /// Nothing moves.
    Still,
    /// x points the other way.
    FlippedX,
    /// y points the other way.
    FlippedY,
    /// Both do: the direction is the other one.
    Reversed,
    /// Vectors are twice as long as meant.
    Halved,
    /// Vectors are half as long as meant.
    Doubled,
    /// Vectors are shares of the picture, and were read as pixels.
    IsUv,
    /// Vectors are pixels, and were read as shares of the picture.
    IsPixels,
    /// The camera's motion is not in the vectors, which are declared to hold it.
    LacksCamera,
    /// The camera's motion is in the vectors, which are declared to lack it.
    HasCamera,
    /// The vectors hold how far the jitter has moved on.
    HasJitter,
    /// The same, with the other sign.
    HasJitterReversed,
}

/// What is known at one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// What the plane alone says, as declared, pixels.
    pub(super) own: [f32; 2],
    /// What the camera's motion makes of a point that stands still, pixels; NaN where unknown.
    pub(super) camera: [f32; 2],
    /// How far the jitter of the field has moved on, pixels.
    pub(super) jitter: [f32; 2],
    /// Size of the image, pixels.
    pub(super) size: [f32; 2],
    /// Whether the stream declares that vectors lack the camera's motion.
    pub(super) adds_camera: bool,
}

impl Hypothesis {
    /// Those that apply to a stream: as declared, still, and then all others.
    pub(super) fn of(format: &StreamFormat) -> Vec<Self> {
        let mut all = vec![
            Self::AsDeclared,
            Self::Still,
            Self::FlippedX,
            Self::FlippedY,
            Self::Reversed,
            Self::Halved,
            Self::Doubled,
            Self::IsUv,
            Self::IsPixels,
            Self::HasJitter,
            Self::HasJitterReversed,
        ];
        if let Some(motion) = format.motion.filter(|_| format.depth.is_some()) {
            all.push(match motion.camera_motion {
                CameraMotion::Included => Self::LacksCamera,
                CameraMotion::Missing => Self::HasCamera,
            });
        }
        all
    }

    /// Whether it is about jitter, which differs where nothing moves too.
    pub(super) fn is_jitter(self) -> bool {
        matches!(self, Self::HasJitter | Self::HasJitterReversed)
    }

    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AsDeclared => "as_declared",
            Self::Still => "still",
            Self::FlippedX => "x_flipped",
            Self::FlippedY => "y_flipped",
            Self::Reversed => "reversed",
            Self::Halved => "halved",
            Self::Doubled => "doubled",
            Self::IsUv => "is_uv",
            Self::IsPixels => "is_pixels",
            Self::LacksCamera => "lacks_camera_motion",
            Self::HasCamera => "has_camera_motion",
            Self::HasJitter => "has_jitter",
            Self::HasJitterReversed => "has_jitter_reversed",
        }
    }

    /// What is wrong if it holds: "motion looks ...".
    #[must_use]
    pub fn says(self) -> &'static str {
        match self {
            Self::AsDeclared => "right",
            Self::Still => "as if nothing moved",
            Self::FlippedX => "x-flipped",
            Self::FlippedY => "y-flipped",
            Self::Reversed => "reversed (the other direction, or both axes flipped)",
            Self::Halved => "twice as long as it is",
            Self::Doubled => "half as long as it is",
            Self::IsUv => "like uv that are read as pixels",
            Self::IsPixels => "like pixels that are read as uv",
            Self::LacksCamera => "as if the camera's motion were not in it",
            Self::HasCamera => "as if the camera's motion were in it already",
            Self::HasJitter => "as if it held the jitter of the projection",
            Self::HasJitterReversed => "as if it held the jitter of the projection, reversed",
        }
    }

    /// Newer minus older position, pixels, if this holds; NaN where that is unknown.
    pub(super) fn displacement(self, known: &Known) -> [f32; 2] {
        let [x, y] = known.own;
        let own = match self {
            Self::Still => return [0.0; 2],
            Self::FlippedX => [-x, y],
            Self::FlippedY => [x, -y],
            Self::Reversed => [-x, -y],
            Self::Halved => [0.5 * x, 0.5 * y],
            Self::Doubled => [2.0 * x, 2.0 * y],
            Self::IsUv => [x * known.size[0], y * known.size[1]],
            Self::IsPixels => [x / known.size[0], y / known.size[1]],
            Self::HasJitter => [x - known.jitter[0], y - known.jitter[1]],
            Self::HasJitterReversed => [x + known.jitter[0], y + known.jitter[1]],
            Self::AsDeclared | Self::LacksCamera | Self::HasCamera => known.own,
        };
        let adds_camera = match self {
            Self::LacksCamera => true,
            Self::HasCamera => false,
            _ => known.adds_camera,
        };
        if adds_camera { [own[0] + known.camera[0], own[1] + known.camera[1]] } else { own }
    }
}
