//! Checks that a plane's numbers describe bytes that are there, and reads its rows.
//!
//! Rows of memory that may change are copied, row by row, into a buffer that stays in a core's
//! cache: what is converted from there has been copied once.

use std::cell::RefCell;

use super::error::{DecodeError, PlaneName};
use crate::format::StreamFormat;
use crate::key::{Pixels, PlaneInput};
use crate::plane::Rect;

/// A plane whose geometry has been checked: every row of `valid` lies inside `pixels`.
#[derive(Clone, Copy, Debug)]
pub(super) struct CheckedPlane<'a> {
    pixels: Pixels<'a>,
    stride: usize,
    bytes_per_pixel: usize,
    pub(super) width: u32,
    pub(super) height: u32,
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
        let found = input.pixels.byte_count();
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
            pixels: input.pixels,
            stride: input.stride as usize,
            bytes_per_pixel: bytes_per_pixel as usize,
            width,
            height,
            valid: input.valid,
            jitter: input.jitter,
        })
    }

    /// Checks that the valid rectangle has a quarter to all of the resolution of `color`'s.
    pub(super) fn check_ratio(
        &self,
        plane: PlaneName,
        color: Rect,
        finest: Rect,
    ) -> Result<(), DecodeError> {
        let (min_width, min_height) = ((color.width / 4).max(1), (color.height / 4).max(1));
        let columns = min_width..=finest.width;
        let rows = min_height..=finest.height;
        if columns.contains(&self.valid.width) && rows.contains(&self.valid.height) {
            return Ok(());
        }
        Err(DecodeError::Ratio {
            plane,
            min_width,
            min_height,
            max_width: finest.width,
            max_height: finest.height,
            width: self.valid.width,
            height: self.valid.height,
        })
    }

    /// Copies row `y` of the whole plane, without padding, into `out`, which is as long.
    #[inline(always)]
    pub(super) fn read_row(&self, y: u32, out: &mut [u8]) {
        let start = y as usize * self.stride;
        match self.pixels {
            Pixels::Bytes(bytes) => out.copy_from_slice(&bytes[start..][..out.len()]),
            Pixels::Reader(reader) => reader.read(start as u64, out),
        }
    }

    /// Calls `work` with the bytes of row `y` of the whole plane, without padding.
    #[inline(always)]
    pub(super) fn with_row(&self, y: u32, work: impl FnOnce(&[u8])) {
        self.with_bytes(y as usize * self.stride, self.width, work);
    }

    /// Calls `work` with the bytes of row `y` of the valid rectangle.
    #[inline(always)]
    pub(super) fn with_valid_row(&self, y: u32, work: impl FnOnce(&[u8])) {
        let row = (self.valid.y + y) as usize * self.stride;
        let start = row + self.valid.x as usize * self.bytes_per_pixel;
        self.with_bytes(start, self.valid.width, work);
    }

    #[inline(always)]
    fn with_bytes(&self, start: usize, pixels: u32, work: impl FnOnce(&[u8])) {
        let length = pixels as usize * self.bytes_per_pixel;
        match self.pixels {
            Pixels::Bytes(bytes) => work(&bytes[start..][..length]),
            Pixels::Reader(reader) => {
                // Taken and put back, as a closure given to the thread's storage is not made for
                // AVX2.
                let mut row = ROW.take();
                row.resize(length, 0);
                reader.read(start as u64, &mut row);
                work(&row);
                ROW.set(row);
            }
        }
    }
}

thread_local! {
    /// Kept from row to row.
    static ROW: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}
