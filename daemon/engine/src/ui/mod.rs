//! The user interface: a premultiplied plane that lies over every picture and is never warped.
//!
//! It comes last, over keys and in-between frames alike, after finishing, and over what other
//! backends have made when that has been read back: so it is the same for all of them. It may
//! change between two keys, as often as the display shows pictures.
//!
//! With `u` the plane, `a` its alpha, `p` the picture, `m` the largest alpha and `a'` the level `a`
//! of a channel's own range, every channel, alpha too, rounded to nearest:
//!
//! ```text
//! (1) rgba8, rgb10a2   min(u, a') + p (m - a) / m
//! (2) rgba16f          u + p (1 - a)                a clamped to 0..1; p where it is 0
//! ```
//!
//! In (1) colour above alpha is cut, as it would not be premultiplied; so nothing overflows. In (2)
//! it may be above, where the interface is brighter than white; the sum is exact before it is
//! rounded to a half (ties to even) and clamped to the largest finite one. Both leave the picture
//! where alpha is 0 and show the plane where it is full, bit for bit.
//!
//! Exactness: `Exact`. Integers; each pixel for itself.

mod cpu;
mod half;
#[cfg(test)]
mod tests;

use rayon::ThreadPool;

use crate::color::ColorPlane;
use crate::decode::{DecodeError, decode_ui};
use crate::format::ColorFormat;
use crate::key::PlaneInput;
use crate::plane::{Plane, Rect};
pub use cpu::composite;

/// A user interface as it arrives, in the format of the stream's colour.
#[derive(Clone, Copy, Debug)]
pub struct UiInput<'a> {
    /// The plane. Only its valid rectangle is shown; it has no jitter.
    pub plane: PlaneInput<'a>,
    /// Column and row of the output that the plane's first pixel lies on.
    pub place: [i32; 2],
}

/// The user interface of one stream, and where something of it is seen.
#[derive(Clone, Debug, Default)]
pub struct UiLayer {
    /// Nothing has come yet: this has no pixels.
    pixels: ColorPlane,
    valid: Rect,
    place: [i32; 2],
    /// Columns of each row from the first to behind the last whose alpha is not 0.
    seen: Plane<[u16; 2]>,
}

impl UiLayer {
    /// Whether nothing has come yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pixels.as_bytes().is_empty()
    }

    /// Takes over what `input` shows, which has pixels of `format`.
    ///
    /// # Errors
    /// If its numbers do not describe pixels that are there. What was shown before stays.
    pub fn set(
        &mut self,
        pool: &ThreadPool,
        format: ColorFormat,
        input: &UiInput<'_>,
    ) -> Result<(), DecodeError> {
        decode_ui(pool, format, &input.plane, &mut self.pixels)?;
        (self.valid, self.place) = (input.plane.valid, input.place);
        cpu::find_seen(pool, &self.pixels, self.valid, &mut self.seen);
        Ok(())
    }
}
