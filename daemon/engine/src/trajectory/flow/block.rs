//! (1) of [`super`], and what a block's own texture is.

use super::BLOCK;
use super::luma::Level;

/// Pixels of a block.
const PIXELS: u32 = BLOCK * BLOCK;

/// (1) of the block at `a` of one level and the one at `b` of another.
#[inline(always)]
pub(super) fn sad(now: &Level, a: [i32; 2], then: &Level, b: [i32; 2]) -> u32 {
    let mut sum = 0;
    for y in 0..BLOCK.cast_signed() {
        let now = now.run::<{ BLOCK as usize }>(a[0], a[1] + y);
        let then = then.run::<{ BLOCK as usize }>(b[0], b[1] + y);
        for (now, then) in now.iter().zip(then) {
            sum += u32::from(now.abs_diff(*then));
        }
    }
    sum
}

/// Sum over a block of the difference from its mean.
pub(super) fn contrast(level: &Level, at: [i32; 2]) -> u32 {
    let rows =
        || (0..BLOCK.cast_signed()).map(|y| level.run::<{ BLOCK as usize }>(at[0], at[1] + y));
    let sum: u32 = rows().flatten().map(|luma| u32::from(*luma)).sum();
    let mean = ((sum + PIXELS / 2) / PIXELS) as u8;
    rows().flatten().map(|luma| u32::from(luma.abs_diff(mean))).sum()
}
