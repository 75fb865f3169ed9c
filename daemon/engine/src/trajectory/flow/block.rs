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

/// (1) without the mean difference: what a change of light leaves.
#[inline(always)]
pub(super) fn sad_in_any_light(now: &Level, a: [i32; 2], then: &Level, b: [i32; 2]) -> u32 {
    const SIDE: usize = BLOCK as usize;
    let mut differences = [[0_i16; SIDE]; SIDE];
    for (y, differences) in (0..).zip(&mut differences) {
        let now = now.run::<SIDE>(a[0], a[1] + y);
        let then = then.run::<SIDE>(b[0], b[1] + y);
        for (difference, (now, then)) in differences.iter_mut().zip(now.iter().zip(then)) {
            *difference = i16::from(*now) - i16::from(*then);
        }
    }
    let sum: i16 = differences.as_flattened().iter().sum();
    let mean = (sum + PIXELS as i16 / 2) >> 6;
    differences.as_flattened().iter().map(|d| u32::from((d - mean).unsigned_abs())).sum()
}

/// Sum over a block of the difference from its mean.
#[inline(always)]
pub(super) fn contrast(level: &Level, at: [i32; 2]) -> u32 {
    let rows =
        || (0..BLOCK.cast_signed()).map(|y| level.run::<{ BLOCK as usize }>(at[0], at[1] + y));
    let sum: u32 = rows().flatten().map(|luma| u32::from(*luma)).sum();
    let mean = ((sum + PIXELS / 2) / PIXELS) as u8;
    rows().flatten().map(|luma| u32::from(luma.abs_diff(mean))).sum()
}
