//! The frames of a capture as `score` and `replay` see them: some are keys, the others are truth.
//!
//! A [`Recording`] says first what there is ([`FrameHead`]) and reads planes only when they are
//! asked for, so that what a method must not see is not even read. A frame may have several motion
//! planes, each back to another content time: one step of the recording, or one of the key rate.
//! [`plan`] divides a recording into keys and frames to predict; [`compose`] finds a key's motion
//! where the recording has none of that step.

pub mod capture;
pub mod compose;
pub mod display;
pub mod keys;
#[cfg(test)]
pub(crate) mod memory;
pub mod plan;

use foreframe_engine::key::Camera;
use foreframe_engine::{KeyInput, MonoTime, Pixels, PlaneInput, Rect, StreamFormat, UiInput};

/// What a frame has, without its pixels.
#[derive(Clone, PartialEq, Debug)]
pub struct FrameHead {
    /// Simulation time that it shows.
    pub content_time: MonoTime,
    /// When it arrived, on the clock of the recording.
    pub arrived_at: MonoTime,
    /// Nothing before it relates to it.
    pub is_cut: bool,
    /// Content time that each of its motion planes points back to.
    pub motions: Vec<MonoTime>,
}

/// One plane in the conventions of the stream, with its bytes.
#[derive(Clone, PartialEq, Debug)]
pub struct OwnedPlane {
    /// Pixels; row `y` starts at `y * stride`.
    pub bytes: Vec<u8>,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next.
    pub stride: u32,
    /// The part that holds the image.
    pub valid: Rect,
    /// Sub-pixel offset of the samples, in pixels of this plane.
    pub jitter: [f32; 2],
}

impl OwnedPlane {
    /// As the engine takes it.
    #[must_use]
    pub fn as_input(&self) -> PlaneInput<'_> {
        PlaneInput {
            pixels: Pixels::Bytes(&self.bytes),
            width: self.width,
            height: self.height,
            stride: self.stride,
            valid: self.valid,
            jitter: self.jitter,
        }
    }
}

/// A frame with those of its planes that were asked for.
#[derive(Clone, PartialEq, Debug)]
pub struct Frame {
    /// Sequence number.
    pub index: u64,
    /// Simulation time that it shows.
    pub content_time: MonoTime,
    /// Content time that `motion` points back to.
    pub motion_from: Option<MonoTime>,
    /// Nothing before it relates to it.
    pub is_cut: bool,
    /// Colour.
    pub color: OwnedPlane,
    /// Depth.
    pub depth: Option<OwnedPlane>,
    /// Motion.
    pub motion: Option<OwnedPlane>,
    /// Class of each pixel.
    pub mask: Option<OwnedPlane>,
    /// User interface, in the format of colour. Only what is replayed shows it.
    pub ui: Option<OwnedPlane>,
    /// Camera at `content_time`.
    pub camera: Option<Camera>,
    /// Camera at `motion_from`.
    pub motion_from_camera: Option<Camera>,
}

impl Frame {
    /// As the engine takes it.
    #[must_use]
    pub fn as_input(&self) -> KeyInput<'_> {
        KeyInput {
            index: self.index,
            content_time: self.content_time,
            motion_from: self.motion_from,
            is_cut: self.is_cut,
            color: self.color.as_input(),
            depth: self.depth.as_ref().map(OwnedPlane::as_input),
            motion: self.motion.as_ref().map(OwnedPlane::as_input),
            mask: self.mask.as_ref().map(OwnedPlane::as_input),
            camera: self.camera,
            motion_from_camera: self.motion_from_camera,
        }
    }

    /// Its user interface as the engine takes it.
    #[must_use]
    pub fn ui_input(&self) -> Option<UiInput<'_>> {
        self.ui.as_ref().map(|ui| UiInput { plane: ui.as_input(), place: [0; 2] })
    }
}

/// Which planes of a frame to read. Camera and colour always are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Wanted {
    /// Colour alone: a ground truth.
    Color,
    /// Colour, depth, mask, user interface, and one of the motion planes of [`FrameHead::motions`],
    /// if any.
    Key {
        /// Which one.
        motion: Option<usize>,
    },
}

/// A sequence of frames in one format, in the order of their content times.
pub trait Recording {
    /// What all frames have in common.
    fn format(&self) -> &StreamFormat;

    /// What each frame has.
    fn heads(&self) -> &[FrameHead];

    /// Reads one frame.
    ///
    /// # Errors
    /// If it cannot be read, or is damaged.
    fn read(&mut self, frame: usize, wanted: Wanted) -> anyhow::Result<Frame>;
}
