//! The reference of [`super`].

use std::ops::Range;

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
            up_row(
                quarter,
                y,
                #[inline(always)]
                |sums| T::expand(sums, row),
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
                    let columns = with_borders(sums, width);
                    T::weigh([above, here, below], [1, 2, 1], &mut sums[columns]);
                    repeat_borders(sums, width);
                    T::halve(sums, row);
                },
            );
        },
    );
}

/// Sums of a row of `width` columns, one more before it and [`BEHIND`] more behind it. Returns
/// where the columns are.
#[inline(always)]
fn with_borders<L: Lanes>(sums: &mut Vec<L>, width: usize) -> Range<usize> {
    sums.resize(1 + width + BEHIND, L::default());
    1..1 + width
}

/// Sums behind a row: its last column again, and one that is read and not used.
const BEHIND: usize = 2;

/// Gives the columns beside a row the sums of those at its borders.
#[inline(always)]
fn repeat_borders<L: Copy>(sums: &mut [L], width: usize) {
    sums[0] = sums[1];
    sums[width + 1] = sums[width];
}

/// Calls `read` with the sums of row `y` of what is a level finer than `coarse`, for
/// [`Wide::expand`].
#[inline(always)]
pub(in crate::finish) fn up_row<T: Wide>(
    coarse: &Plane<T>,
    y: u32,
    read: impl FnOnce(&[T::Lanes]),
) {
    let (middle, last) = (y / 2, coarse.height() - 1);
    let above = coarse.row(middle.saturating_sub(1));
    let rows = [above, coarse.row(middle), coarse.row((middle + 1).min(last))];
    // (3)
    let weights = if y.is_multiple_of(2) { [1, 6, 1] } else { [0, 4, 4] };
    T::Lanes::with_row(
        #[inline(always)]
        |sums: &mut Vec<T::Lanes>| {
            let width = coarse.width() as usize;
            let columns = with_borders(sums, width);
            T::weigh(rows, weights, &mut sums[columns]);
            repeat_borders(sums, width);
            read(sums);
        },
    );
}
