//! Reads a colour plane between its pixels.

use crate::color::Texel;
use crate::plane::{Plane, Rect};

/// The colour at (`x`, `y`) in Q8 pixels, bilinear, clamped to the pixel centres of `valid`, which
/// lies inside the plane.
#[must_use]
pub fn sample<T: Texel>(plane: &Plane<T>, valid: Rect, x: i32, y: i32) -> T {
    let (x0, x1, fx) = neighbours(x, valid.x, valid.width);
    let (y0, y1, fy) = neighbours(y, valid.y, valid.height);
    let (top, bottom) = (plane.row(y0), plane.row(y1));
    if fx | fy == 0 {
        return top[x0 as usize];
    }
    let (left, right) = (x0 as usize, x1 as usize);
    T::bilinear([top[left], top[right], bottom[left], bottom[right]], fx, fy)
}

/// The two pixels around a Q8 position inside `start..start + length`, and the way between them.
#[expect(clippy::cast_sign_loss, reason = "clamped to 0 and above before the cast")]
#[expect(clippy::cast_possible_wrap, reason = "planes are at most 8192 pixels wide and high")]
fn neighbours(position: i32, start: u32, length: u32) -> (u32, u32, u32) {
    let first = (start << 8) as i32;
    let last = ((start + length - 1) << 8) as i32;
    let clamped = position.clamp(first, last) as u32;
    let low = clamped >> 8;
    (low, (low + 1).min(start + length - 1), clamped & 0xff)
}
