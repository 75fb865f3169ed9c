//! The reference of [`super`], row by row. Rows cost what changes in them.

use rayon::ThreadPool;

use crate::bands::for_each_row;
use crate::color::{
    ColorFormat, ColorPlane, OrderedRgba16, Rgb10a2, Rgba8, Texel, half_to_ordered,
};
use crate::light::TILE;
use crate::plane::{Plane, Rect};

/// Steps from the middle of a tile to that of the next, twice as many as pixels.
pub const WAYS: i32 = 2 * TILE as i32;
/// Code of a half float of 0.
pub const BLACK: u16 = half_to_ordered(0);
/// Of the largest that is finite.
pub const BRIGHTEST: u16 = half_to_ordered(0x7bff);
/// An octave of a half float, in codes.
const OCTAVE: f32 = 1024.0;

/// The gain of a picture of `format` that is brighter by so many 1/1024 octaves.
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "below two octaves")]
#[expect(clippy::cast_precision_loss, reason = "below two octaves")]
pub fn gain(format: ColorFormat, steps: i32) -> i32 {
    match format {
        ColorFormat::Rgba8 | ColorFormat::Rgb10a2 => {
            libm::roundf(4096.0 * libm::exp2f(steps as f32 / OCTAVE)) as i32
        }
        ColorFormat::Rgba16f => steps,
    }
}

/// A kind of pixel that can be made brighter.
trait Lit: Texel {
    /// The gain that changes nothing.
    const NEUTRAL: i32;

    /// (1) or (2).
    fn lit(self, gain: i32) -> Self;
}

/// (1) of a channel whose last level is `last`.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "at most the last level")]
#[expect(clippy::cast_sign_loss, reason = "gains of integer formats are above 0")]
fn scaled(level: u16, gain: i32, last: u32) -> u16 {
    ((u32::from(level) * gain as u32 + 2048) >> 12).min(last) as u16
}

impl Lit for Rgba8 {
    const NEUTRAL: i32 = 4096;

    #[inline(always)]
    fn lit(self, gain: i32) -> Self {
        let [r, g, b, a] = self.channels();
        let [r, g, b] = [r, g, b].map(|level| scaled(level, gain, 255));
        Self::of_channels([r, g, b, a])
    }
}

impl Lit for Rgb10a2 {
    const NEUTRAL: i32 = 4096;

    #[inline(always)]
    fn lit(self, gain: i32) -> Self {
        let [r, g, b, a] = self.channels();
        let [r, g, b] = [r, g, b].map(|level| scaled(level, gain, 1023));
        Self::of_channels([r, g, b, a])
    }
}

impl Lit for OrderedRgba16 {
    const NEUTRAL: i32 = 0;

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "clamped to finite codes")]
    #[expect(clippy::cast_sign_loss, reason = "clamped to codes above that of 0")]
    fn lit(self, gain: i32) -> Self {
        let shifted = |code: u16| {
            let moved = i32::from(code) + gain;
            let is_light = code > BLACK && code <= BRIGHTEST;
            let limited = moved.clamp(i32::from(BLACK) + 1, i32::from(BRIGHTEST)) as u16;
            if is_light { limited } else { code }
        };
        let [r, g, b, a] = self.0;
        Self([shifted(r), shifted(g), shifted(b), a])
    }
}

/// (1) or (2) of the part `valid` of `picture`, with `gains` per tile of it.
pub fn relight(pool: &ThreadPool, gains: &Plane<i32>, valid: Rect, picture: &mut ColorPlane) {
    match picture {
        ColorPlane::Rgba8(picture) => rows(pool, gains, valid, picture),
        ColorPlane::Rgb10a2(picture) => rows(pool, gains, valid, picture),
        ColorPlane::Rgba16f(picture) => rows(pool, gains, valid, picture),
    }
}

fn rows<T: Lit>(pool: &ThreadPool, gains: &Plane<i32>, valid: Rect, picture: &mut Plane<T>) {
    for_each_row(
        pool,
        picture,
        #[inline(always)]
        |y, row| {
            if !(valid.y..valid.y + valid.height).contains(&y) {
                return;
            }
            let row = &mut row[valid.x as usize..][..valid.width as usize];
            light_row(gains, y - valid.y, row);
        },
    );
}

/// A row of the valid rectangle, the `y`-th.
#[inline(always)]
fn light_row<T: Lit>(gains: &Plane<i32>, y: u32, row: &mut [T]) {
    let place = 2 * y as i32 + 1 - TILE as i32;
    let (above, way) = (place.div_euclid(WAYS), place.rem_euclid(WAYS));
    let line = |y: i32| gains.row(y.clamp(0, gains.height() as i32 - 1) as u32);
    let (above, below) = (line(above), line(above + 1));
    // In 1/16.
    let column = |i: usize| {
        let i = i.min(above.len() - 1);
        (WAYS - way) * above[i] + way * below[i]
    };
    let neutral = WAYS * T::NEUTRAL;
    let half = (TILE as usize / 2).min(row.len());
    let (head, rest) = row.split_at_mut(half);
    let mut left = column(0);
    if left != neutral {
        let gain = between(left, left, 0);
        head.iter_mut().for_each(|texel| *texel = texel.lit(gain));
    }
    for (i, pixels) in rest.chunks_mut(TILE as usize).enumerate() {
        let right = column(i + 1);
        if (left, right) != (neutral, neutral) {
            for (way, texel) in (1..WAYS).step_by(2).zip(pixels) {
                *texel = texel.lit(between(left, right, way));
            }
        }
        left = right;
    }
}

/// The gain at `way` from one column of tiles to the next, from theirs in 1/16; rounded down after
/// a half is added.
#[inline(always)]
fn between(left: i32, right: i32, way: i32) -> i32 {
    ((WAYS - way) * left + way * right + WAYS * WAYS / 2) >> 8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{hash, noise, plane, pool};

    /// By the definition, pixel by pixel.
    fn slowly(gains: &Plane<i32>, valid: Rect, picture: &ColorPlane) -> Vec<[u16; 4]> {
        let lit = |x: u32, y: u32, texel: [u16; 4]| {
            let inside =
                x.wrapping_sub(valid.x) < valid.width && y.wrapping_sub(valid.y) < valid.height;
            if !inside {
                return texel;
            }
            let place = |at: u32| 2 * at.cast_signed() + 1 - TILE.cast_signed();
            let (x, y) = (place(x - valid.x), place(y - valid.y));
            let of = |column: i32, row: i32| {
                let column = column.clamp(0, gains.width().cast_signed() - 1);
                let row = row.clamp(0, gains.height().cast_signed() - 1);
                gains.at(column.cast_unsigned(), row.cast_unsigned())
            };
            let (column, row) = (x.div_euclid(16), y.div_euclid(16));
            let (right, down) = (x.rem_euclid(16), y.rem_euclid(16));
            let column =
                |i: i32| (16 - down) * of(column + i, row) + down * of(column + i, row + 1);
            let gain = ((16 - right) * column(0) + right * column(1) + 128).div_euclid(256);
            let [r, g, b, a] = texel;
            let [r, g, b] = match picture {
                ColorPlane::Rgba8(_) => [r, g, b].map(|c| scaled(c, gain, 255)),
                ColorPlane::Rgb10a2(_) => [r, g, b].map(|c| scaled(c, gain, 1023)),
                ColorPlane::Rgba16f(_) => [r, g, b].map(|c| {
                    let is_light = (0x8001..=0xfbff).contains(&c);
                    let moved = (i32::from(c) + gain).clamp(0x8001, 0xfbff);
                    if is_light { u16::try_from(moved).unwrap() } else { c }
                }),
            };
            [r, g, b, a]
        };
        fn each<T: Texel>(
            plane: &Plane<T>,
            lit: impl Fn(u32, u32, [u16; 4]) -> [u16; 4],
        ) -> Vec<[u16; 4]> {
            let pixels = (0..plane.height()).flat_map(|y| (0..plane.width()).map(move |x| (x, y)));
            pixels.map(|(x, y)| lit(x, y, plane.at(x, y).channels())).collect()
        }
        match picture {
            ColorPlane::Rgba8(plane) => each(plane, lit),
            ColorPlane::Rgb10a2(plane) => each(plane, lit),
            ColorPlane::Rgba16f(plane) => each(plane, lit),
        }
    }

    #[test]
    fn every_size_and_format_is_relit_as_defined_by_any_number_of_threads() {
        let valid_of = |[width, height]: [u32; 2]| match width {
            203 => Rect { x: 3, y: 5, width: 190, height: 66 },
            _ => Rect::full(width, height),
        };
        for (seed, size) in (0..).zip([[1, 1], [4, 3], [17, 9], [64, 40], [203, 77]]) {
            for format in [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f] {
                let valid = valid_of(size);
                let tiles = [valid.width, valid.height].map(|side| side.div_ceil(TILE));
                // Some of them stay as they are.
                let gains = plane(tiles[0], tiles[1], |x, y| {
                    let steps = (hash(x, y, seed) % 1200).cast_signed() - 600;
                    gain(format, if hash(x, y, 3).is_multiple_of(3) { 0 } else { steps })
                });
                let picture = noise(format, size[0], size[1], seed);
                let expected = slowly(&gains, valid, &picture);
                for threads in [1, 5] {
                    let mut made = picture.clone();
                    relight(&pool(threads), &gains, valid, &mut made);
                    let nothing = plane(tiles[0], tiles[1], |_, _| gain(format, 0));
                    assert_eq!(slowly(&nothing, valid, &made), expected, "{format:?} {size:?}");
                }
                let mut same = picture.clone();
                let nothing = plane(tiles[0], tiles[1], |_, _| gain(format, 0));
                relight(&pool(2), &nothing, valid, &mut same);
                assert_eq!(same, picture, "{format:?} {size:?}: no gain");
            }
        }
    }
}
