//! The fast path of [`super`]: tiles of target cells that know how far their sources moved.
//!
//! The velocities of each tile of source cells are bounded once per key. Before a frame the bounds
//! of every source tile are noted in the target tiles that it can land on, which gives each of
//! those a window: by how many whole cells its sources can have moved. Mostly that is one or two,
//! and then every target cell looks at the few source cells in its window, a loop without
//! addresses or atomics. Where the window is wide, the cells of the noted source tiles are
//! splatted one by one; where nearly everything lands everywhere, so is the whole plane.

use rayon::ThreadPool;

use super::source::{Bounds, SourceField, TILE};
use super::window::{MAX_CANDIDATES, Target, look};
use super::{NO_SOURCE, one_by_one, phase_in_cells, shift};
use crate::bands::for_each_chunk;
use crate::field::FieldMap;
use crate::phase::Phase;
use crate::plane::Plane;

/// Most noted source tiles per target tile, on average.
const MAX_SOURCES: usize = 48;
/// The end of a list.
const END: u32 = u32::MAX;

/// Buffers of [`scatter`], kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct ScatterScratch {
    windows: Vec<Window>,
    /// Noted source tiles, as lists: tile, and the place of the next.
    noted: Vec<[u32; 2]>,
    /// Depth keys of (2), where cells are splatted one by one.
    top: Plane<u32>,
}

/// What lands on a target tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// The fewest and the most whole cells that its sources moved by, right and down; none where
    /// the fewest are more.
    pub(super) fewest: [i32; 2],
    pub(super) most: [i32; 2],
    /// Where the list of its source tiles starts.
    first: u32,
}

impl Window {
    const EMPTY: Self = Self { fewest: [i32::MAX; 2], most: [i32::MIN; 2], first: END };

    /// How many source cells each of its cells has to look at; saturates.
    pub(super) fn candidates(&self) -> usize {
        let [columns, rows] = [0, 1].map(|axis| {
            let reach = i64::from(self.most[axis]) - i64::from(self.fewest[axis]) + 2;
            usize::try_from(reach).unwrap_or(0)
        });
        columns.saturating_mul(rows)
    }
}

/// Splats `source` into `splat`.
pub fn scatter(
    pool: &ThreadPool,
    source: &SourceField,
    map: &FieldMap,
    phase: Phase,
    scratch: &mut ScatterScratch,
    splat: &mut Plane<u32>,
) {
    let size = [source.velocity.width(), source.velocity.height()];
    splat.resize(size[0], size[1]);
    let scale = [phase_in_cells(phase, &map.x), phase_in_cells(phase, &map.y)];
    if !scratch.note_windows(source, scale) {
        one_by_one::scatter(source, map, phase, &mut scratch.top, splat);
        return;
    }
    let ScatterScratch { windows, noted, .. } = scratch;
    let [tile_width, tile_height] = TILE;
    let columns = size[0].div_ceil(tile_width) as usize;
    let length = (size[0] * tile_height) as usize;
    for_each_chunk(
        pool,
        splat.data_mut(),
        length,
        #[inline(always)]
        |row, splat| {
            let windows = &windows[row as usize * columns..][..columns];
            for (x, window) in (0..).step_by(tile_width as usize).zip(windows) {
                let y = row * tile_height;
                let end = [(x + tile_width).min(size[0]), (y + tile_height).min(size[1])];
                let target = Target { source, scale, start: [x, y], end };
                if window.candidates() <= MAX_CANDIDATES {
                    look(&target, window, splat);
                } else {
                    let tiles = Noted { noted, next: window.first };
                    splat_tiles(&target, tiles, columns as u32, splat);
                }
            }
        },
    );
}

impl ScatterScratch {
    /// Fills the windows. False where too many source tiles land on too many target tiles.
    pub(super) fn note_windows(&mut self, source: &SourceField, scale: [i32; 2]) -> bool {
        let Self { windows, noted, .. } = self;
        let bounds = &source.bounds;
        let cells = [source.velocity.width(), source.velocity.height()].map(u32::cast_signed);
        let tiles = [bounds.width(), bounds.height()];
        windows.clear();
        windows.resize(bounds.data().len(), Window::EMPTY);
        noted.clear();
        let most_noted = MAX_SOURCES * windows.len();
        for (i, Bounds { low, high }) in (0_u32..).zip(bounds.data()) {
            let tile = [i % tiles[0], i / tiles[0]];
            let fewest = [0, 1].map(|axis| shift(low[axis], scale[axis]) >> 8);
            let most = [0, 1].map(|axis| shift(high[axis], scale[axis]) >> 8);
            // The tiles that its cells are splatted on, from the first to the last.
            let [across, down] = [0, 1].map(|axis| {
                let length = TILE[axis].cast_signed();
                let first = tile[axis].cast_signed() * length;
                let last = (first + length).min(cells[axis]) - 1;
                let from = (first + fewest[axis]).max(0);
                let to = (last + most[axis] + 1).min(cells[axis] - 1);
                (from <= to).then(|| (from / length) as u32..=(to / length) as u32)
            });
            let (Some(across), Some(down)) = (across, down) else { continue };
            for y in down {
                for x in across.clone() {
                    let window = &mut windows[(y * tiles[0] + x) as usize];
                    for axis in 0..2 {
                        window.fewest[axis] = window.fewest[axis].min(fewest[axis]);
                        window.most[axis] = window.most[axis].max(most[axis]);
                    }
                    let place = u32::try_from(noted.len()).expect("far fewer than 2^32 are noted");
                    noted.push([i, window.first]);
                    window.first = place;
                }
            }
            if noted.len() > most_noted {
                return false;
            }
        }
        true
    }

    /// Whether any target tile has more candidates than it looks at.
    #[cfg(test)]
    pub(super) fn has_wide_window(&self) -> bool {
        self.windows.iter().any(|window| window.candidates() > MAX_CANDIDATES)
    }
}

/// The source tiles that are noted for a target tile.
#[derive(Clone)]
struct Noted<'a> {
    noted: &'a [[u32; 2]],
    next: u32,
}

impl Iterator for Noted<'_> {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        let [tile, next] = *self.noted.get(self.next as usize)?;
        self.next = next;
        Some(tile)
    }
}

/// Splats the cells of the source tiles `tiles`, of which a row has `columns`, on one target tile.
/// `splat` has the rows of the target tile.
fn splat_tiles(
    target: &Target<'_>,
    tiles: impl Iterator<Item = u32> + Clone,
    columns: u32,
    splat: &mut [u32],
) {
    const CELLS: usize = (TILE[0] * TILE[1]) as usize;
    let (mut top, mut nearest) = ([0; CELLS], [NO_SOURCE; CELLS]);
    let [start_x, start_y] = target.start;
    let size = [0, 1].map(|axis| target.end[axis] - target.start[axis]);
    let velocity = &target.source.velocity;
    let each = |add: &mut dyn FnMut(usize, u32, u32)| {
        for tile in tiles.clone() {
            let [x, y] = [tile % columns * TILE[0], tile / columns * TILE[1]];
            let end = [(x + TILE[0]).min(velocity.width()), (y + TILE[1]).min(velocity.height())];
            let cells = (y..end[1]).flat_map(|y| (x..end[0]).map(move |x| [x, y]));
            for cell in cells {
                one_by_one::for_each_corner(target.source, target.scale, cell, |x, y, d, rank| {
                    let at = [x.wrapping_sub(start_x), y.wrapping_sub(start_y)];
                    if at[0] < size[0] && at[1] < size[1] {
                        add((at[1] * TILE[0] + at[0]) as usize, d, rank);
                    }
                });
            }
        }
    };
    each(&mut |cell, depth, _| top[cell] = top[cell].max(depth));
    each(&mut |cell, depth, rank| {
        if depth >= top[cell] - (top[cell] >> 8) {
            nearest[cell] = nearest[cell].min(rank);
        }
    });
    let width = velocity.width() as usize;
    let rows = splat.chunks_mut(width).zip(nearest.chunks(TILE[0] as usize));
    for (splat, nearest) in rows.take(size[1] as usize) {
        let count = size[0] as usize;
        splat[start_x as usize..][..count].copy_from_slice(&nearest[..count]);
    }
}
