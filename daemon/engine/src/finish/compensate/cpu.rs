//! The reference of [`super`].

use std::cell::RefCell;

use rayon::ThreadPool;

#[cfg(target_arch = "x86_64")]
use super::avx2;
use crate::bands::for_each_row;
use crate::color::{ColorPlane, Rgba8, Texel};
use crate::finish::lanes::{Wide, expanded, mixed};
use crate::finish::pyramid::{Pyramid, up_row};
use crate::finish::selection::{FULL, row_weights};
use crate::finish::shares::{ByteTables, Split};
use crate::plane::{Plane, Rect};
#[cfg(target_arch = "x86_64")]
use crate::simd::has_avx2;

/// (2) or (3) of the part `valid` of `picture`, whose levels are `pyramid`.
pub fn compensate(
    pool: &ThreadPool,
    split: &Split<'_>,
    valid: Rect,
    pyramid: &Pyramid,
    picture: &mut ColorPlane,
) {
    match (&pyramid.smooth, picture) {
        (ColorPlane::Rgba8(smooth), ColorPlane::Rgba8(picture)) => {
            bytes(pool, split, valid, smooth, picture);
        }
        (ColorPlane::Rgb10a2(smooth), ColorPlane::Rgb10a2(picture)) => {
            channels(pool, split, valid, smooth, picture);
        }
        (ColorPlane::Rgba16f(smooth), ColorPlane::Rgba16f(picture)) => {
            channels(pool, split, valid, smooth, picture);
        }
        _ => unreachable!("the pyramid has the format of the picture"),
    }
}

fn bytes(
    pool: &ThreadPool,
    split: &Split<'_>,
    valid: Rect,
    smooth: &Plane<Rgba8>,
    picture: &mut Plane<Rgba8>,
) {
    let Some(tables) = &split.tables.bytes else {
        return channels(pool, split, valid, smooth, picture);
    };
    for_each_blurred_row(
        pool,
        split.weights,
        valid,
        smooth,
        picture,
        #[inline(always)]
        |sums, weights, row| {
            let mut done = 0;
            #[cfg(target_arch = "x86_64")]
            if has_avx2() {
                // SAFETY: the processor has AVX2, asked for just above.
                done = unsafe { avx2::row(tables, split.is_key, sums, weights, row) };
            }
            for (x, texel) in row.iter_mut().enumerate().skip(done) {
                let weight = weights.map_or(FULL, |weights| weights[x]);
                let blurred = mixed(*texel, expanded(sums, x), weight);
                *texel = tables.of(split.is_key, *texel, blurred);
            }
        },
    );
}

fn channels<T: Wide>(
    pool: &ThreadPool,
    split: &Split<'_>,
    valid: Rect,
    smooth: &Plane<T>,
    picture: &mut Plane<T>,
) {
    for_each_blurred_row(
        pool,
        split.weights,
        valid,
        smooth,
        picture,
        #[inline(always)]
        |sums, weights, row| {
            for (x, texel) in row.iter_mut().enumerate() {
                let weight = weights.map_or(FULL, |weights| weights[x]);
                *texel = split.of(*texel, mixed(*texel, expanded(sums, x), weight));
            }
        },
    );
}

/// Calls `inside(sums, weights, pixels)` for every row of the part `valid` of `picture` that is
/// blurred anywhere, with the sums of the row of `smooth` that lies there and how far each pixel is
/// blurred; None where all of them are, fully.
fn for_each_blurred_row<T: Wide>(
    pool: &ThreadPool,
    tiles: Option<&Plane<u8>>,
    valid: Rect,
    smooth: &Plane<T>,
    picture: &mut Plane<T>,
    inside: impl Fn(&[T::Lanes], Option<&[u8]>, &mut [T]) + Sync,
) {
    for_each_row(
        pool,
        picture,
        #[inline(always)]
        |y, row| {
            if !(valid.y..valid.y + valid.height).contains(&y) {
                return;
            }
            let (left, right) = (valid.x as usize, (valid.x + valid.width) as usize);
            let (y, row) = (y - valid.y, &mut row[left..right]);
            let Some(tiles) = tiles else {
                return up_row(
                    smooth,
                    y,
                    #[inline(always)]
                    |sums| inside(sums, None, row),
                );
            };
            with_weights(
                tiles,
                y,
                row.len(),
                #[inline(always)]
                |weights| {
                    up_row(
                        smooth,
                        y,
                        #[inline(always)]
                        |sums| inside(sums, Some(weights), row),
                    );
                },
            );
        },
    );
}

/// Calls `work` with the weights of `count` pixels of row `y`, if any is above 0.
#[inline(always)]
fn with_weights(tiles: &Plane<u8>, y: u32, count: usize, work: impl FnOnce(&[u8])) {
    thread_local! {
        static ROOM: RefCell<(Vec<u16>, Vec<u8>)> = const { RefCell::new((Vec::new(), Vec::new())) };
    }
    // Taken and put back, as a closure given to the thread's storage is not made for AVX2.
    let (mut columns, mut weights) = ROOM.take();
    weights.resize(count, 0);
    if row_weights(tiles, y, &mut columns, &mut weights) {
        work(&weights);
    }
    ROOM.set((columns, weights));
}

impl Split<'_> {
    /// What a pixel becomes, by definition.
    pub(in crate::finish) fn of<T: Wide>(&self, original: T, blurred: T) -> T {
        let (mut levels, blurred) = (original.channels(), blurred.channels());
        for (channel, table) in self.tables.channels.iter().enumerate() {
            let split = table.split(levels[channel], blurred[channel]);
            levels[channel] = if self.is_key { split.key } else { split.in_between };
        }
        T::of_channels(levels)
    }
}

impl ByteTables {
    /// What a pixel becomes, by the tables.
    pub(in crate::finish) fn of(&self, is_key: bool, original: Rgba8, blurred: Rgba8) -> Rgba8 {
        let (mut levels, blurred) = (original.channels(), blurred.channels());
        for channel in 0..3 {
            let [level, blurred] = [levels[channel], blurred[channel]].map(usize::from);
            levels[channel] = if is_key {
                self.key[channel][level * 256 + blurred].into()
            } else {
                let [low, high, ..] = self.within[channel][level].to_le_bytes().map(u16::from);
                (blurred as u16).clamp(low, high)
            };
        }
        Rgba8::of_channels(levels)
    }
}
