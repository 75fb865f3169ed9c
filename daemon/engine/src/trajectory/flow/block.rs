//! (1) of [`super`], and what a block's own texture is.

use super::BLOCK;
use super::luma::Level;
use super::own::{SIDE, in_any_light};

/// Pixels of a block.
const PIXELS: u32 = BLOCK * BLOCK;

/// (1) of the block at `a` of one level and the one at `b` of another.
#[inline(always)]
pub(super) fn sad(now: &Level, a: [i32; 2], then: &Level, b: [i32; 2]) -> u32 {
    let mut sum = 0;
    for (now, then) in now.block(a).zip(then.block(b)) {
        for (now, then) in now.iter().zip(then) {
            sum += u32::from(now.abs_diff(*then));
        }
    }
    sum
}

/// (1) without the mean difference: what a change of light leaves.
#[inline(always)]
pub(super) fn sad_in_any_light(now: &Level, a: [i32; 2], then: &Level, b: [i32; 2]) -> u32 {
    let mut differences = [[0_i16; SIDE]; SIDE];
    let rows = now.block(a).zip(then.block(b));
    for (differences, (now, then)) in differences.iter_mut().zip(rows) {
        for (difference, (now, then)) in differences.iter_mut().zip(now.iter().zip(then)) {
            *difference = i16::from(*now) - i16::from(*then);
        }
    }
    let sum: i16 = differences.as_flattened().iter().sum();
    let mean = (sum + PIXELS as i16 / 2) >> 6;
    differences.as_flattened().iter().map(|d| u32::from((d - mean).unsigned_abs())).sum()
}

/// The same of the block at `a` and the one at `from` (Q8 pixels), between pixels, as
/// [`super::own::in_any_light`] has it.
#[inline(always)]
pub(super) fn sad_between(now: &Level, a: [i32; 2], then: &Level, from: [i32; 2]) -> u32 {
    let [fx, fy] = [from[0] & 0xff, from[1] & 0xff];
    let mut across = [[0; SIDE]; SIDE + 1];
    for (y, across) in (from[1] >> 8..).zip(&mut across) {
        let row = then.run::<{ SIDE + 1 }>(from[0] >> 8, y);
        for (across, pair) in across.iter_mut().zip(row.windows(2)) {
            *across = (i32::from(pair[0]) * (256 - fx) + i32::from(pair[1]) * fx) >> 4;
        }
    }
    let mut r = [[0; SIDE]; SIDE];
    for ((r, luma), rows) in r.iter_mut().zip(now.block(a)).zip(across.windows(2)) {
        for i in 0..SIDE {
            let was = (rows[0][i] * (256 - fy) + rows[1][i] * fy) >> 8;
            r[i] = was - 16 * i32::from(luma[i]);
        }
    }
    in_any_light(&r, &[[true; SIDE]; SIDE])
}

/// Sum over a block of the difference from its mean.
#[inline(always)]
pub(super) fn contrast(level: &Level, at: [i32; 2]) -> u32 {
    let rows = || level.block(at);
    let sum: u32 = rows().flatten().map(|luma| u32::from(*luma)).sum();
    let mean = ((sum + PIXELS / 2) / PIXELS) as u8;
    rows().flatten().map(|luma| u32::from(luma.abs_diff(mean))).sum()
}
