//! Where the pixels of a row are read in smooth cells: (1) of [`super`].
//!
//! Displacement is interpolated between cell centres, down to the row once per cell and then along
//! the row once per pixel, a block of pixels at a time.

#[cfg(target_arch = "x86_64")]
mod avx2;

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::__m256i;

use super::cpu::Frame;
use crate::warp::sample::Positions;

/// Pixels whose positions are computed before they are read.
pub(super) const BLOCK: usize = 64;
/// Pixels of one wide step.
const LANES: usize = 8;
/// Cells of a block: one more on either side, and what a wide step reads beyond the last.
const CELLS: usize = BLOCK + LANES + 2;

/// The velocities of the cells above and below a row of pixels.
pub(super) struct Between<'a> {
    frame: &'a Frame<'a>,
    above: &'a [[i16; 2]],
    below: &'a [[i16; 2]],
    way_y: i32,
    /// The block's first pixel, their number, and the cell before the first.
    first: u32,
    pixels: usize,
    start: usize,
    /// Displacements of the block's cells and of the right neighbour of the last, interpolated
    /// down to the row, x and y; `count` of them hold.
    cells: [[i32; CELLS]; 2],
    count: usize,
}

impl<'a> Between<'a> {
    /// Of row `index_y` of the valid rectangle.
    pub(super) fn new(frame: &'a Frame<'a>, index_y: u32) -> Self {
        let (y, way) = frame.map.y.before(index_y);
        let carried = &frame.field.carried;
        Self {
            frame,
            above: carried.row(y),
            below: carried.row((y + 1).min(carried.height() - 1)),
            way_y: way.cast_signed(),
            first: 0,
            pixels: 0,
            start: 0,
            cells: [[0; CELLS]; 2],
            count: 1,
        }
    }

    /// Goes to the block of `pixels` pixels from `first` on.
    #[inline(always)]
    pub(super) fn go_to(&mut self, first: u32, pixels: usize) {
        let map = &self.frame.map.x;
        let last = first + pixels as u32 - 1;
        let (start, end) = (map.before(first).0 as usize, map.before(last).0 as usize + 1);
        let end = end.min(self.above.len() - 1);
        let (phase, way_y) = (self.frame.phase.q12(), self.way_y);
        let (above, below) = (&self.above[start..=end], &self.below[start..=end]);
        let [xs, ys] = &mut self.cells;
        for ((x, y), (above, below)) in xs.iter_mut().zip(ys).zip(above.iter().zip(below)) {
            let shift = |v: i16| (i32::from(v) * phase + 256) >> 9;
            *x = lerp(shift(above[0]), shift(below[0]), way_y);
            *y = lerp(shift(above[1]), shift(below[1]), way_y);
        }
        (self.first, self.pixels, self.start) = (first, pixels, start);
        self.count = end - start + 1;
        for cells in &mut self.cells {
            cells[self.count] = cells[self.count - 1];
        }
    }

    /// The displacement of all pixels of the block, where it is the same.
    #[inline(always)]
    pub(super) fn shared(&self) -> Option<[i32; 2]> {
        let shared = self.cells.map(|cells| cells[0]);
        let differs = |axis: usize| {
            let cells = &self.cells[axis][..self.count];
            cells.iter().fold(0, |differs, cell| differs | (cell ^ shared[axis]))
        };
        (differs(0) | differs(1) == 0).then_some(shared)
    }

    /// (1): where the pixels of the block are read, of which `p_y` is y and `p_x` that of the
    /// first, Q8. In broken cells the result is not used.
    #[inline(always)]
    pub(super) fn positions(&self, p: [i32; 2]) -> BlockPositions<'_> {
        let map = &self.frame.map.x;
        BlockPositions {
            cells: &self.cells,
            start: self.start,
            places: map.before_each(self.first, self.pixels),
            p,
        }
    }
}

/// Where the pixels of a block are read.
pub(super) struct BlockPositions<'a> {
    /// Displacements of cells from number `start` on, x and y.
    cells: &'a [[i32; CELLS]; 2],
    start: usize,
    /// For each pixel the cell before it and the way to the next one.
    places: &'a [[u16; 2]],
    /// The first pixel.
    p: [i32; 2],
}

impl Positions for BlockPositions<'_> {
    #[inline(always)]
    fn at(&self, i: usize) -> [i32; 2] {
        let [cell, way] = self.places[i];
        let cell = usize::from(cell) - self.start;
        let [dx, dy] = self.cells.map(|cells| lerp(cells[cell], cells[cell + 1], i32::from(way)));
        [self.p[0] + ((i as i32) << 8) - dx, self.p[1] - dy]
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    unsafe fn eight(&self, i: usize) -> [__m256i; 2] {
        // SAFETY: the caller has AVX2.
        unsafe { avx2::positions(self, i) }
    }
}

/// `a + ((b - a) way + 128) / 256`, rounded down. Displacements stay within 2^20, so nothing
/// overflows; in a smooth cell they differ by half a pixel at most.
#[inline(always)]
fn lerp(a: i32, b: i32, way: i32) -> i32 {
    a + (((b - a) * way + 128) >> 8)
}
