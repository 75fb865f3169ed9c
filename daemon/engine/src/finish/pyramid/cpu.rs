//! The reference of [`super`].

use std::ops::Range;

use rayon::ThreadPool;

use super::Pyramid;
use crate::bands::for_each_row;
use crate::color::ColorPlane;
use crate::finish::lanes::{Lanes, Wide};
use crate::finish::selection::TILE;
use crate::plane::{Plane, Rect};

/// (1), (2) and (4) of the part `valid` of `picture`, as far as what is blurred by these `weights`
/// of tiles reads them; all of them without. What nothing reads keeps what was there.
pub fn pyramid(
    pool: &ThreadPool,
    picture: &ColorPlane,
    valid: Rect,
    weights: Option<&Plane<u8>>,
    levels: &mut Pyramid,
) {
    let format = picture.format();
    let half = [valid.width, valid.height].map(|side| side.div_ceil(2));
    let quarter = half.map(|side| side.div_ceil(2));
    levels.half.reset(format, half[0], half[1]);
    levels.quarter.reset(format, quarter[0], quarter[1]);
    levels.smooth.reset(format, half[0], half[1]);
    let Pyramid { half, quarter, smooth } = levels;
    let read = &Read::new(weights);
    match (picture, half, quarter, smooth) {
        (
            ColorPlane::Rgba8(picture),
            ColorPlane::Rgba8(half),
            ColorPlane::Rgba8(quarter),
            ColorPlane::Rgba8(smooth),
        ) => build(pool, picture, valid, read, [half, quarter, smooth]),
        (
            ColorPlane::Rgb10a2(picture),
            ColorPlane::Rgb10a2(half),
            ColorPlane::Rgb10a2(quarter),
            ColorPlane::Rgb10a2(smooth),
        ) => build(pool, picture, valid, read, [half, quarter, smooth]),
        (
            ColorPlane::Rgba16f(picture),
            ColorPlane::Rgba16f(half),
            ColorPlane::Rgba16f(quarter),
            ColorPlane::Rgba16f(smooth),
        ) => build(pool, picture, valid, read, [half, quarter, smooth]),
        _ => unreachable!("every level has just been given the format of the picture"),
    }
}

fn build<T: Wide>(
    pool: &ThreadPool,
    picture: &Plane<T>,
    valid: Rect,
    read: &Read,
    [half, quarter, smooth]: [&mut Plane<T>; 3],
) {
    down(pool, picture, valid, |y| read.is_near(2 * y), half);
    let whole = Rect::full(half.width(), half.height());
    down(pool, half, whole, |y| read.is_near(4 * y), quarter);
    let quarter = &*quarter;
    for_each_row(
        pool,
        smooth,
        #[inline(always)]
        |y, row| {
            if !read.is_near(2 * y) {
                return;
            }
            up_row(
                quarter,
                y,
                #[inline(always)]
                |sums| T::expand(sums, row),
            );
        },
    );
}

/// Which rows of tiles are blurred anywhere; None where all are.
struct Read(Option<Vec<bool>>);

impl Read {
    /// Rows of tiles above and below a blurred one whose pixels it reads or gives a weight to: one
    /// of weights, and 16 pixels of three levels.
    const REACH: usize = 3;

    fn new(weights: Option<&Plane<u8>>) -> Self {
        Self(weights.map(|weights| {
            let rows = 0..weights.height();
            let is_blurred = |y: u32| weights.row(y).iter().any(|weight| *weight > 0);
            rows.map(is_blurred).collect()
        }))
    }

    /// Whether a level's row that lies on row `y` of the picture is read.
    #[inline(always)]
    fn is_near(&self, y: u32) -> bool {
        let Some(rows) = &self.0 else { return true };
        let row = (y / TILE) as usize;
        let end = (row + Self::REACH + 1).min(rows.len());
        rows[row.saturating_sub(Self::REACH).min(end)..end].contains(&true)
    }
}

/// (1) of the part `valid` of `fine`, of the rows that are read.
fn down<T: Wide>(
    pool: &ThreadPool,
    fine: &Plane<T>,
    valid: Rect,
    is_read: impl Fn(u32) -> bool + Sync,
    coarse: &mut Plane<T>,
) {
    let (left, width) = (valid.x as usize, valid.width as usize);
    for_each_row(
        pool,
        coarse,
        #[inline(always)]
        |y, row| {
            if !is_read(y) {
                return;
            }
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
