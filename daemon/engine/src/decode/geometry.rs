//! Checks that a plane's numbers describe bytes that are there.

use super::error::{DecodeError, PlaneName};
use crate::format::StreamFormat;
use crate::key::PlaneInput;
use crate::plane::Rect;

/// A plane whose geometry has been checked: every row of `valid` lies inside `bytes`.
#[derive(Clone, Copy, Debug)]
pub(super) struct CheckedPlane<'a> {
    bytes: &'a [u8],
    stride: usize,
    bytes_per_pixel: usize,
    pub(super) width: u32,
    pub(super) valid: Rect,
    pub(super) jitter: [f32; 2],
}

impl<'a> CheckedPlane<'a> {
    /// Checks size, stride, number of bytes, valid rectangle and jitter, in this order.
    pub(super) fn new(
        plane: PlaneName,
        input: &PlaneInput<'a>,
        bytes_per_pixel: u32,
    ) -> Result<Self, DecodeError> {
        let (width, height) = (input.width, input.height);
        let max = StreamFormat::MAX_SIZE;
        if width == 0 || height == 0 || width > max || height > max {
            return Err(DecodeError::PlaneSize { plane, max, width, height });
        }
        let row = u64::from(width) * u64::from(bytes_per_pixel);
        if u64::from(input.stride) < row {
            return Err(DecodeError::Stride { plane, expected: row, found: input.stride });
        }
        let expected = u64::from(height - 1) * u64::from(input.stride) + row;
        let found = input.bytes.len() as u64;
        if found < expected {
            return Err(DecodeError::TooFewBytes { plane, expected, found });
        }
        if !input.valid.fits(width, height) {
            return Err(DecodeError::ValidRect { plane, width, height, found: input.valid });
        }
        if !input.jitter.iter().all(|jitter| (-1.0..=1.0).contains(jitter)) {
            return Err(DecodeError::Jitter { plane, found: input.jitter });
        }
        Ok(Self {
            bytes: input.bytes,
            stride: input.stride as usize,
            bytes_per_pixel: bytes_per_pixel as usize,
            width,
            valid: input.valid,
            jitter: input.jitter,
        })
    }

    /// Checks that the valid rectangle has a quarter to all of the resolution of `color`'s.
    pub(super) fn check_ratio(&self, plane: PlaneName, color: Rect) -> Result<(), DecodeError> {
        let (min_width, min_height) = ((color.width / 4).max(1), (color.height / 4).max(1));
        let columns = min_width..=color.width;
        let rows = min_height..=color.height;
        if columns.contains(&self.valid.width) && rows.contains(&self.valid.height) {
            return Ok(());
        }
        Err(DecodeError::Ratio {
            plane,
            min_width,
            min_height,
            max_width: color.width,
            max_height: color.height,
            width: self.valid.width,
            height: self.valid.height,
        })
    }

    /// The bytes of row `y` of the whole plane, without padding.
    pub(super) fn row(&self, y: u32) -> &'a [u8] {
        &self.bytes[y as usize * self.stride..][..self.width as usize * self.bytes_per_pixel]
    }

    /// The bytes of row `y` of the valid rectangle.
    pub(super) fn valid_row(&self, y: u32) -> &'a [u8] {
        let start = self.valid.x as usize * self.bytes_per_pixel;
        &self.row(self.valid.y + y)[start..][..self.valid.width as usize * self.bytes_per_pixel]
    }
}
