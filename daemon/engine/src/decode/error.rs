//! What is wrong with a key frame, with what was expected and what was found.

use std::fmt;

use crate::plane::Rect;
use crate::time::MonoTime;

/// Names a plane in a message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PlaneName {
    /// Colour.
    Color,
    /// Depth.
    Depth,
    /// Motion.
    Motion,
    /// User interface.
    Ui,
    /// Class of each pixel.
    Mask,
}

impl fmt::Display for PlaneName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Color => "colour",
            Self::Depth => "depth",
            Self::Motion => "motion",
            Self::Ui => "UI",
            Self::Mask => "mask",
        })
    }
}

/// A key frame that contradicts its stream, or holds what cannot be converted.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The stream's own size is out of range.
    #[error("stream size: expected 1x1 to {max}x{max} pixels, found {width}x{height}")]
    StreamSize {
        /// Largest width and height.
        max: u32,
        /// Of the stream.
        width: u32,
        /// Of the stream.
        height: u32,
    },
    /// A scale of the motion convention cannot be used.
    #[error("motion scale: expected finite numbers other than 0, found {found:?}")]
    MotionScale {
        /// What the stream declared, x and y.
        found: [f32; 2],
    },
    /// The colour plane does not have the stream's size.
    #[error(
        "colour plane: expected {expected_width}x{expected_height} pixels, found {width}x{height}"
    )]
    ColorSize {
        /// Of the stream.
        expected_width: u32,
        /// Of the stream.
        expected_height: u32,
        /// Of the plane.
        width: u32,
        /// Of the plane.
        height: u32,
    },
    /// A plane has no pixels, or more than a plane may have.
    #[error("{plane} plane: expected 1x1 to {max}x{max} pixels, found {width}x{height}")]
    PlaneSize {
        /// Which plane.
        plane: PlaneName,
        /// Largest width and height.
        max: u32,
        /// Of the plane.
        width: u32,
        /// Of the plane.
        height: u32,
    },
    /// Rows overlap.
    #[error("{plane} plane: expected a stride of at least {expected} bytes, found {found}")]
    Stride {
        /// Which plane.
        plane: PlaneName,
        /// Bytes of one row of pixels.
        expected: u64,
        /// The stride.
        found: u32,
    },
    /// The last row ends after the last byte.
    #[error("{plane} plane: expected at least {expected} bytes, found {found}")]
    TooFewBytes {
        /// Which plane.
        plane: PlaneName,
        /// Bytes up to the end of the last row.
        expected: u64,
        /// Bytes that there are.
        found: u64,
    },
    /// The valid rectangle is empty or reaches out of the plane.
    #[error(
        "{plane} plane: expected a valid rectangle inside {width}x{height} pixels, \
         found {}x{} at {}, {}", .found.width, .found.height, .found.x, .found.y
    )]
    ValidRect {
        /// Which plane.
        plane: PlaneName,
        /// Of the plane.
        width: u32,
        /// Of the plane.
        height: u32,
        /// The rectangle.
        found: Rect,
    },
    /// A plane is finer than colour, or coarser than a quarter of it.
    #[error(
        "{plane} plane: expected {min_width}x{min_height} to {max_width}x{max_height} valid \
         pixels, found {width}x{height}"
    )]
    Ratio {
        /// Which plane.
        plane: PlaneName,
        /// A quarter of the colour's valid columns.
        min_width: u32,
        /// A quarter of the colour's valid rows.
        min_height: u32,
        /// The colour's valid columns.
        max_width: u32,
        /// The colour's valid rows.
        max_height: u32,
        /// Of the plane's valid rectangle.
        width: u32,
        /// Of the plane's valid rectangle.
        height: u32,
    },
    /// More cells than a scatter can number.
    #[error("field of depth and motion: expected at most {max} cells, found {width}x{height}")]
    FieldSize {
        /// Most cells.
        max: u32,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A jitter that is not a sub-pixel offset.
    #[error("{plane} plane: expected a jitter within -1 to 1 pixel, found {found:?}")]
    Jitter {
        /// Which plane.
        plane: PlaneName,
        /// What was declared, x and y.
        found: [f32; 2],
    },
    /// A plane that the stream never declared.
    #[error("{plane} plane: expected none, because the stream declares none; found one")]
    Undeclared {
        /// Which plane.
        plane: PlaneName,
    },
    /// A matrix holds NaN or infinity, or cannot be inverted.
    #[error("{matrix} matrix: expected {expected}, found {found}")]
    Matrix {
        /// Which matrix.
        matrix: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        found: f32,
    },
    /// Motion that does not point back in time.
    #[error("motion plane: expected to point back from {content_time:?}, found {motion_from:?}")]
    MotionFrom {
        /// Of the key.
        content_time: MonoTime,
        /// Not earlier than it.
        motion_from: MonoTime,
    },
    /// Content time did not advance.
    #[error("content time: expected later than {newest:?}, found {found:?}")]
    TimeBackwards {
        /// Content time of the newest key.
        newest: MonoTime,
        /// Content time of the refused key.
        found: MonoTime,
    },
}
