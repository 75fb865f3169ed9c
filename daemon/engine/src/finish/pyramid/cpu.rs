//! The reference of [`super`].

use rayon::ThreadPool;

use super::Pyramid;
use crate::bands::for_each_row;
use crate::color::ColorPlane;
use crate::finish::lanes::{Lanes, Wide};
use crate::plane::{Plane, Rect};

/// (1), (2) and (4) of the part `valid` of `picture`.
pub fn pyramid(pool: &ThreadPool, picture: &ColorPlane, valid: Rect, levels: &mut Pyramid) {
    let format = picture.format();
    let half = [valid.width, valid.height].map(|side| side.div_ceil(2));
    let quarter = half.map(|side| side.div_ceil(2));
    levels.half.reset(format, half[0], half[1]);
    levels.quarter.reset(format, quarter[0], quarter[1]);
    levels.smooth.reset(format, half[0], half[1]);
    let Pyramid { half, quarter, smooth } = levels;
    match (picture, half, quarter, smooth) {
        (
            ColorPlane::Rgba8(picture),
            ColorPlane::Rgba8(half),
            ColorPlane::Rgba8(quarter),
            ColorPlane::Rgba8(smooth),
        ) => build(pool, picture, valid, [half, quarter, smooth]),
        (
            ColorPlane::Rgb10a2(picture),
            ColorPlane::Rgb10a2(half),
            ColorPlane::Rgb10a2(quarter),
            ColorPlane::Rgb10a2(smooth),
        ) => build(pool, picture, valid, [half, quarter, smooth]),
        (
            ColorPlane::Rgba16f(picture),
            ColorPlane::Rgba16f(half),
            ColorPlane::Rgba16f(quarter),
            ColorPlane::Rgba16f(smooth),
        ) => build(pool, picture, valid, [half, quarter, smooth]),
        _ => unreachable!("every level has just been given the format of the picture"),
    }
}

fn build<T: Wide>(
    pool: &ThreadPool,
    picture: &Plane<T>,
    valid: Rect,
    [half, quarter, smooth]: [&mut Plane<T>; 3],
) {
    down(pool, picture, valid, half);
    down(pool, half, Rect::full(half.width(), half.height()), quarter);
    let quarter = &*quarter;
    for_each_row(
        pool,
        smooth,
        #[inline(always)]
        |y, row| {
            let width = row.len();
            up_rows(
                quarter,
                y,
                #[inline(always)]
                |coarse: Expanded<'_, T::Lanes>| {
                    for (x, texel) in row.iter_mut().enumerate().take(width) {
                        *texel = T::narrow(coarse.at(x));
                    }
                },
            );
        },
    );
}

/// (1) of the part `valid` of `fine`.
fn down<T: Wide>(pool: &ThreadPool, fine: &Plane<T>, valid: Rect, coarse: &mut Plane<T>) {
    let (left, width) = (valid.x as usize, valid.width as usize);
    for_each_row(
        pool,
        coarse,
        #[inline(always)]
        |y, row| {
            let line = |y: u32| &fine.row(valid.y + y)[left..left + width];
            let middle = 2 * y;
            let (above, here) = (line(middle.saturating_sub(1)), line(middle));
            let below = line((middle + 1).min(valid.height - 1));
            T::Lanes::with_row(
                #[inline(always)]
                |sums: &mut Vec<T::Lanes>| {
                    sums.clear();
                    sums.extend(above.iter().zip(here).zip(below).map(
                        #[inline(always)]
                        |((above, here), below)| {
                            above.widen() + (here.widen() << 1) + below.widen()
                        },
                    ));
                    // Beside each border its pixel again.
                    let last = sums[width - 1];
                    sums.push(last);
                    let first = sums[0];
                    let (sums, mut before) = (sums.as_slice(), first);
                    for (texel, pair) in row.iter_mut().zip(sums.chunks_exact(2)) {
                        *texel = T::narrow((before + (pair[0] << 1) + pair[1]).rounded(4));
                        before = pair[1];
                    }
                },
            );
        },
    );
}

/// Row `y` of the finer level, seen from above.
pub(in crate::finish) struct Expanded<'a, L> {
    /// Of each column of the coarse level, 8 times what the finer row shows there; beside each
    /// border its column again.
    pub(in crate::finish) sums: &'a [L],
}

impl<L: Lanes> Expanded<'_, L> {
    /// (3) in column `x`.
    #[inline(always)]
    pub(in crate::finish) fn at(&self, x: usize) -> L {
        let [before, here, after] = [0, 1, 2].map(|tap| self.sums[x / 2 + tap]);
        let sum = if x.is_multiple_of(2) {
            before + (here << 2) + (here << 1) + after
        } else {
            (here << 2) + (after << 2)
        };
        sum.rounded(6)
    }
}

/// Calls `read` with row `y` of what is a level finer than `coarse`.
#[inline(always)]
pub(in crate::finish) fn up_rows<T: Wide>(
    coarse: &Plane<T>,
    y: u32,
    read: impl FnOnce(Expanded<'_, T::Lanes>),
) {
    let (middle, last) = (y / 2, coarse.height() - 1);
    let here = coarse.row(middle);
    let below = coarse.row((middle + 1).min(last));
    T::Lanes::with_row(
        #[inline(always)]
        |sums: &mut Vec<T::Lanes>| {
            sums.clear();
            sums.push(T::Lanes::default());
            if y.is_multiple_of(2) {
                let above = coarse.row(middle.saturating_sub(1));
                sums.extend(above.iter().zip(here).zip(below).map(
                    #[inline(always)]
                    |((above, here), below)| {
                        let here = here.widen();
                        above.widen() + (here << 2) + (here << 1) + below.widen()
                    },
                ));
            } else {
                sums.extend(here.iter().zip(below).map(
                    #[inline(always)]
                    |(here, below)| (here.widen() << 2) + (below.widen() << 2),
                ));
            }
            sums[0] = sums[1];
            let last = sums[sums.len() - 1];
            sums.push(last);
            read(Expanded { sums });
        },
    );
}
