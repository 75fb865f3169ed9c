//! The fast path of [`super`]: tiles of target cells that know how far their sources moved.
//!
//! The velocities of each tile of source cells are bounded once per key. Before a frame the bounds
//! of every source tile widen the windows of the target tiles that it can land on: by how many
//! whole cells their sources can have moved. Mostly that is one or two, and then every target cell
//! looks at the few source cells in its window, a loop without addresses or atomics. Where windows
//! are wide all over, as before a lattice, looking costs more than splatting ([`super::runs`]).

use rayon::ThreadPool;

use super::source::{Bounds, SourceField, TILE};
use super::window::{Target, look};
use super::{phase_in_cells, runs, shift};
use crate::bands::for_each_chunk;
use crate::field::FieldMap;
use crate::phase::Phase;
use crate::plane::Plane;

/// Most source cells that a target cell looks at, on average. About as many take as long as a
/// splat.
const MOST_CANDIDATES: usize = 14;
/// Most source cells that any target cell looks at: one thread works on a tile, and remembers what
/// it found.
const WIDEST: usize = 1024;

/// Buffers of [`scatter`], kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct ScatterScratch {
    windows: Vec<Window>,
    /// Depth keys of (2), where cells are splatted.
    top: Plane<u32>,
}

/// How far what lands on a target tile has moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// The fewest and the most whole cells, right and down; the fewest are more where nothing
    /// lands.
    pub(super) fewest: [i32; 2],
    pub(super) most: [i32; 2],
}

impl Window {
    const EMPTY: Self = Self { fewest: [i32::MAX; 2], most: [i32::MIN; 2] };

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
    if !scratch.find_windows(source, scale) {
        runs::scatter(pool, source, scale, &mut scratch.top, splat);
        return;
    }
    let windows = &scratch.windows;
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
                look(&target, window, splat);
            }
        },
    );
}

impl ScatterScratch {
    /// Finds the windows. False where looking through them is not worth it.
    pub(super) fn find_windows(&mut self, source: &SourceField, scale: [i32; 2]) -> bool {
        let windows = &mut self.windows;
        let bounds = &source.bounds;
        let cells = [source.velocity.width(), source.velocity.height()].map(u32::cast_signed);
        let tiles = [bounds.width(), bounds.height()];
        windows.clear();
        windows.resize(bounds.data().len(), Window::EMPTY);
        // Where many source tiles land on many target tiles, windows are wide for sure.
        let mut left = MOST_CANDIDATES * windows.len();
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
                    let Some(fewer) = left.checked_sub(1) else { return false };
                    left = fewer;
                }
            }
        }
        let candidates = || windows.iter().map(Window::candidates);
        candidates().all(|count| count <= WIDEST)
            && candidates().sum::<usize>() <= MOST_CANDIDATES * windows.len()
    }
}
