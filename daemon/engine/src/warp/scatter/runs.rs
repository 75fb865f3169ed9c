//! Where sources come from all over: runs of source cells that move by the same whole cells.
//!
//! A field that shears slowly moves many neighbours by the same whole number of cells and only by
//! another fraction. Along such a run every target cell has exactly two sources in the row, the
//! one that lands left of it and the one that lands right of it, so that loops over the run need
//! no addresses. Threads need no atomics: each owns a band of target rows and visits the source
//! rows that can reach it.

use std::ops::Range;

use rayon::ThreadPool;

use super::source::TILE;
use super::{NO_SOURCE, SOURCE_BITS, SourceField, shift};
use crate::bands::for_each_band;
use crate::key::Velocity;
use crate::plane::Plane;

/// Rows of a band. Few enough for its planes to stay in a core's cache, many enough that
/// few source rows are visited by two bands.
const BAND_ROWS: usize = 64;
/// Source cells whose landing places are computed together.
const BLOCK: usize = 256;

/// Splats `source`, moved by `scale`, into `splat`; `top` keeps the depth keys of (2).
pub(super) fn scatter(
    pool: &ThreadPool,
    source: &SourceField,
    scale: [i32; 2],
    top: &mut Plane<u32>,
    splat: &mut Plane<u32>,
) {
    let (width, height) = (source.velocity.width(), source.velocity.height());
    top.resize(width, height);
    splat.resize(width, height);
    let band_rows = BAND_ROWS.min((height as usize).div_ceil(pool.current_num_threads()));
    for_each_band(
        pool,
        top,
        splat,
        band_rows,
        #[inline(always)]
        |first_row, top, splat| {
            top.fill(0);
            splat.fill(NO_SOURCE);
            let mut band = Band { source, scale, first_row, top, splat };
            band.visit(
                #[inline(always)]
                |top, _, Splat { depth, lands, .. }| {
                    *top = (*top).max(if lands { depth } else { 0 });
                },
            );
            band.visit(
                #[inline(always)]
                |top, splat, Splat { depth, lands, candidate }| {
                    let shows = lands & (depth >= *top - (*top >> 8));
                    *splat = (*splat).min(if shows { candidate } else { NO_SOURCE });
                },
            );
        },
    );
}

/// What one source cell brings to one target cell.
#[derive(Clone, Copy)]
struct Splat {
    depth: u32,
    /// Of (3).
    candidate: u32,
    /// Whether it lands there at all.
    lands: bool,
}

/// A run of target rows and what lands on it.
struct Band<'a> {
    source: &'a SourceField,
    scale: [i32; 2],
    first_row: u32,
    top: &'a mut [u32],
    splat: &'a mut [u32],
}

/// Where the cells of a block land: whole cells right and down of their own place, and how far
/// beyond, Q8.
struct Landing {
    right_by: [i32; BLOCK],
    down_by: [i32; BLOCK],
    x: [u32; BLOCK],
    y: [u32; BLOCK],
}

impl Landing {
    #[inline(always)]
    fn update(&mut self, velocities: &[Velocity], [scale_x, scale_y]: [i32; 2]) {
        let cells = self.right_by.iter_mut().zip(&mut self.down_by).zip(&mut self.x);
        for ((((right_by, down_by), x), y), velocity) in cells.zip(&mut self.y).zip(velocities) {
            let (moved_x, moved_y) = (shift(velocity.x, scale_x), shift(velocity.y, scale_y));
            (*right_by, *down_by) = (moved_x >> 8, moved_y >> 8);
            (*x, *y) = ((moved_x & 0xff).cast_unsigned(), (moved_y & 0xff).cast_unsigned());
        }
    }

    /// The end of the run of cells from `start` on that move by the same whole cells.
    #[inline(always)]
    fn run_end(&self, start: usize, count: usize) -> usize {
        const STEP: usize = 16;
        let (right_by, down_by) = (self.right_by[start], self.down_by[start]);
        let mut end = start;
        while end + STEP <= count {
            let cells = self.right_by[end..end + STEP].iter().zip(&self.down_by[end..end + STEP]);
            let differs = cells.fold(0, |differs, (x, y)| differs | (x ^ right_by) | (y ^ down_by));
            if differs != 0 {
                break;
            }
            end += STEP;
        }
        while end < count && self.right_by[end] == right_by && self.down_by[end] == down_by {
            end += 1;
        }
        end
    }
}

/// The rows that a source row is splatted on: the one above where it lands, and the one below.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Above,
    Below,
}

impl Side {
    /// How far cells that land `y` below a row are from the target row.
    #[inline(always)]
    fn away(self, y: u32) -> u32 {
        match self {
            Self::Above => y,
            Self::Below => 256 - y,
        }
    }

    /// Whether cells that land `y` below a row reach the target row.
    #[inline(always)]
    fn is_reached(self, y: u32) -> bool {
        self == Self::Above || y > 0
    }
}

impl Band<'_> {
    /// Calls `add(top, splat, what lands there)` for each splat on the band.
    #[inline(always)]
    fn visit(&mut self, add: impl Fn(&mut u32, &mut u32, Splat) + Copy) {
        let source = self.source;
        let width = source.velocity.width() as usize;
        let rows = (self.top.len() / width).cast_signed();
        let first_row = self.first_row as isize;
        let mut landing =
            Landing { right_by: [0; BLOCK], down_by: [0; BLOCK], x: [0; BLOCK], y: [0; BLOCK] };
        for y in 0..source.velocity.height() {
            let bounds = source.bounds.row(y / TILE[1]);
            let slowest = bounds.iter().fold(i16::MAX, |slowest, b| slowest.min(b.low[1]));
            let fastest = bounds.iter().fold(i16::MIN, |fastest, b| fastest.max(b.high[1]));
            let land = |v: i16| (y as isize) + (shift(v, self.scale[1]) >> 8) as isize;
            let (from, to) = (land(slowest) - first_row, land(fastest) + 1 - first_row);
            if to < 0 || from >= rows {
                continue;
            }
            for (block, velocities) in source.velocity.row(y).chunks(BLOCK).enumerate() {
                landing.update(velocities, self.scale);
                let mut start = 0;
                while start < velocities.len() {
                    let end = landing.run_end(start, velocities.len());
                    self.splat_run([block * BLOCK, y as usize], start..end, &landing, add);
                    start = end;
                }
            }
        }
    }

    /// Splats the cells `run` of the block that starts at (`x`, `y`).
    #[inline(always)]
    fn splat_run(
        &mut self,
        [x, y]: [usize; 2],
        run: Range<usize>,
        landing: &Landing,
        add: impl Fn(&mut u32, &mut u32, Splat) + Copy,
    ) {
        let width = self.source.velocity.width() as usize;
        let rows = self.top.len() / width;
        let above = y as isize + landing.down_by[run.start] as isize - self.first_row as isize;
        for (side, row) in [(Side::Above, above), (Side::Below, above + 1)] {
            let Some(row) = usize::try_from(row).ok().filter(|row| *row < rows) else { continue };
            if side == Side::Below && landing.y[run.clone()].iter().fold(0, |any, y| any | y) == 0 {
                continue;
            }
            self.splat_row(side, row, [x, y], run.clone(), landing, add);
        }
    }

    /// The part of [`Self::splat_run`] on one row of the band.
    #[inline(always)]
    fn splat_row(
        &mut self,
        side: Side,
        row: usize,
        [x, y]: [usize; 2],
        run: Range<usize>,
        landing: &Landing,
        add: impl Fn(&mut u32, &mut u32, Splat) + Copy,
    ) {
        let width = self.source.velocity.width() as usize;
        let (tops, splats) =
            (&mut self.top[row * width..][..width], &mut self.splat[row * width..][..width]);
        let depths = &self.source.depth.row(y as u32)[x..];
        let first = (y * width + x) as u32;
        // What a cell brings to the target column left of where it lands, and right of it.
        let left = |depth: u32, [x, y]: [u32; 2], cell: u32| Splat {
            depth,
            candidate: ((x + side.away(y)) >> 2 << SOURCE_BITS) | cell,
            lands: side.is_reached(y),
        };
        let right = |depth: u32, [x, y]: [u32; 2], cell: u32| Splat {
            depth,
            candidate: ((256 - x + side.away(y)) >> 2 << SOURCE_BITS) | cell,
            lands: side.is_reached(y) & (x > 0),
        };
        let way = |i: usize| [landing.x[i], landing.y[i]];
        let shift = x as isize + landing.right_by[run.start] as isize;
        let column =
            |i: usize| usize::try_from(i as isize + shift).ok().filter(|column| *column < width);
        if let Some(column) = column(run.start) {
            let i = run.start;
            add(&mut tops[column], &mut splats[column], left(depths[i], way(i), first + i as u32));
        }
        if let Some(column) = column(run.end) {
            let i = run.end - 1;
            add(&mut tops[column], &mut splats[column], right(depths[i], way(i), first + i as u32));
        }
        // Columns between: of cell i from its left, of cell i - 1 from its right.
        let from = (run.start + 1).max(0_usize.saturating_add_signed(-shift));
        let to = run.end.min(width.saturating_add_signed(-shift));
        if from >= to {
            return;
        }
        let count = to - from;
        let place = from.wrapping_add_signed(shift);
        let columns = tops[place..][..count].iter_mut().zip(&mut splats[place..][..count]);
        let depths = depths[from - 1..to].windows(2);
        let ways_x = landing.x[from - 1..to].windows(2);
        let ways_y = landing.y[from - 1..to].windows(2);
        let sources = depths.zip(ways_x).zip(ways_y);
        let cells = first + from as u32..;
        for (((top, splat), ((depth, x), y)), cell) in columns.zip(sources).zip(cells) {
            add(top, splat, left(depth[1], [x[1], y[1]], cell));
            add(top, splat, right(depth[0], [x[0], y[0]], cell - 1));
        }
    }
}
