//! A tile whose sources all moved by about the same: each target cell looks at the few source
//! cells that can land on it.

#[cfg(target_arch = "x86_64")]
mod avx2;

use std::cell::RefCell;
use std::ops::Range;

use super::source::{SourceField, TILE};
use super::tiles::Window;
use super::{NO_SOURCE, SOURCE_BITS, shift};
#[cfg(target_arch = "x86_64")]
use crate::simd::has_avx2;
use crate::simd::widest;

/// Columns of a tile.
const COLUMNS: usize = TILE[0] as usize;

/// A tile of target cells.
pub(super) struct Target<'a> {
    pub(super) source: &'a SourceField,
    pub(super) scale: [i32; 2],
    pub(super) start: [u32; 2],
    pub(super) end: [u32; 2],
}

/// A source cell for each cell of a row of the tile: its depth key, 0 where it does not land
/// there, and its candidate of (3), [`NO_SOURCE`] where it does not.
#[derive(Clone, Copy)]
struct Candidates {
    depth: [u32; COLUMNS],
    rank: [u32; COLUMNS],
}

const NOTHING: Candidates = Candidates { depth: [0; COLUMNS], rank: [NO_SOURCE; COLUMNS] };

/// Splats what lands on `target`, all of it inside `window`. `splat` has the rows of the tile.
pub(super) fn look(target: &Target<'_>, window: &Window, splat: &mut [u32]) {
    #[cfg(target_arch = "x86_64")]
    if has_avx2() {
        // SAFETY: the processor has AVX2, asked for just above.
        let done = unsafe { avx2::look(target, window, splat) };
        if done {
            return;
        }
    }
    widest(
        #[inline(always)]
        || look_anywhere(target, window, splat),
    );
}

/// The rows of source cells that row `y` of the target looks at.
fn source_rows(target: &Target<'_>, window: &Window, y: u32) -> Range<u32> {
    let height = i64::from(target.source.velocity.height());
    let row = |moved: i32| (i64::from(y) - i64::from(moved)).clamp(0, height) as u32;
    row(window.most[1].saturating_add(1))..row(window.fewest[1].saturating_sub(1))
}

/// [`look`] at and beyond the border of the grid too.
#[inline(always)]
fn look_anywhere(target: &Target<'_>, window: &Window, splat: &mut [u32]) {
    let size = [target.source.velocity.width(), target.source.velocity.height()];
    let columns = target.start[0] as usize..target.end[0] as usize;
    let mut found = FOUND.take();
    found.resize(window.candidates().max(found.len()), NOTHING);
    let rows = splat.chunks_mut(size[0] as usize).zip(target.start[1]..target.end[1]);
    for (splat, y) in rows {
        let splat = &mut splat[columns.clone()];
        let mut top = [0; COLUMNS];
        let mut count = 0;
        for source_y in source_rows(target, window, y) {
            for moved in window.fewest[0]..=window.most[0].saturating_add(1) {
                // Target columns that have a source cell `moved` to their left.
                let inside = clamp(columns.clone(), moved, size[0]);
                if inside.is_empty() {
                    continue;
                }
                let candidates = &mut found[count];
                count += 1;
                if inside != columns {
                    *candidates = NOTHING;
                }
                let places = inside.start - columns.start..inside.end - columns.start;
                let first = inside.start.wrapping_add_signed(-(moved as isize));
                let row = Row {
                    y: source_y,
                    first,
                    away: [-(moved << 8), (source_y.cast_signed() - y.cast_signed()) << 8],
                };
                candidates.update(target, &row, places, &mut top);
            }
        }
        splat.fill(NO_SOURCE);
        for Candidates { depth, rank } in &found[..count] {
            let cells = splat.iter_mut().zip(&top).zip(depth.iter().zip(rank));
            for ((splat, top), (depth, rank)) in cells {
                let is_near = *depth >= *top - (*top >> 8);
                *splat = (*splat).min(if is_near { *rank } else { NO_SOURCE });
            }
        }
    }
    FOUND.set(found);
}

thread_local! {
    /// Kept from tile to tile.
    static FOUND: RefCell<Vec<Candidates>> = const { RefCell::new(Vec::new()) };
}

/// The part of `columns` whose cells lie inside a grid of `width` columns when moved left by
/// `moved`.
fn clamp(columns: Range<usize>, moved: i32, width: u32) -> Range<usize> {
    let moved = moved as isize;
    let start = columns.start.max(0_usize.saturating_add_signed(moved));
    let end = columns.end.min((width as usize).saturating_add_signed(moved));
    start..end.max(start)
}

/// Source cells in a row, one for each target cell.
struct Row {
    y: u32,
    first: usize,
    /// From the target cells to them, Q8 cells.
    away: [i32; 2],
}

impl Candidates {
    /// Fills `places` and raises `top` to the largest depth key.
    #[inline(always)]
    fn update(
        &mut self,
        target: &Target<'_>,
        row: &Row,
        places: Range<usize>,
        top: &mut [u32; COLUMNS],
    ) {
        let source = target.source;
        let first = row.y * source.velocity.width() + row.first as u32;
        let velocities = &source.velocity.row(row.y)[row.first..][..places.len()];
        let depths = &source.depth.row(row.y)[row.first..][..places.len()];
        let found = &mut self.depth[places.clone()][..velocities.len()];
        let ranks = &mut self.rank[places.clone()][..velocities.len()];
        let top = &mut top[places][..velocities.len()];
        for i in 0..velocities.len() {
            let (v, depth, cell) = (velocities[i], depths[i], first + i as u32);
            let x = (row.away[0] + shift(v.x, target.scale[0])).unsigned_abs();
            let y = (row.away[1] + shift(v.y, target.scale[1])).unsigned_abs();
            let lands = (x | y) < 256;
            found[i] = if lands { depth } else { 0 };
            ranks[i] = if lands { ((x + y) >> 2 << SOURCE_BITS) | cell } else { NO_SOURCE };
            top[i] = top[i].max(found[i]);
        }
    }
}
