//! The border of the engine: converts what a stream declared to the one convention inside.
//!
//! Owns every conversion of STREAM conventions (direction, unit, scale, jitter, depth meaning,
//! plane ratio, valid rectangle) and every check of plane geometry and of poisoned numbers.

use crate::color::{ColorPlane, Rgba8};
use crate::format::{ColorFormat, StreamFormat};
use crate::key::{KeyFrame, KeyInput};
use crate::plane::{Plane, Rect};

/// A key frame that contradicts its stream, or holds what cannot be converted.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
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
}

/// Converts one key frame.
///
/// # Errors
/// If its planes contradict the stream's format.
pub fn decode_key(format: &StreamFormat, input: &KeyInput<'_>) -> Result<KeyFrame, DecodeError> {
    let (width, height) = (input.color.width, input.color.height);
    if (width, height) != (format.width, format.height) {
        return Err(DecodeError::ColorSize {
            expected_width: format.width,
            expected_height: format.height,
            width,
            height,
        });
    }
    let mut color = ColorPlane::new(ColorFormat::Rgba8, width, height);
    if let ColorPlane::Rgba8(plane) = &mut color {
        for y in 0..height {
            let row = &input.color.bytes[y as usize * input.color.stride as usize..];
            for (texel, bytes) in plane.row_mut(y).iter_mut().zip(row.chunks_exact(4)) {
                *texel = Rgba8(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
            }
        }
    }
    Ok(KeyFrame {
        index: input.index,
        content_time: input.content_time,
        motion_from: None,
        is_cut: input.is_cut,
        color,
        valid: Rect::full(width, height),
        depth: Plane::default(),
        velocity: Plane::default(),
        camera: input.camera,
    })
}
