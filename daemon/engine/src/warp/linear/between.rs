//! Where the pixels of a row are read in smooth cells: (1) of [`super`].
//!
//! Displacement is interpolated between cell centres, down to the row once per cell and then along
//! the row once per pixel.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256i, __m512i};

use super::cpu::Frame;
#[cfg(target_arch = "x86_64")]
use crate::simd::has_avx2;
use crate::warp::sample::Positions;

/// Pixels of the widest step.
const LANES: usize = 16;

/// Displacements of the cells of a row, interpolated down to a row of pixels, x and y: anything
/// around broken cells. The last one is repeated as often as a wide step reads beyond it.
#[derive(Debug, Default)]
pub(super) struct RowCells {
    xs: Vec<i32>,
    ys: Vec<i32>,
    /// Whether there are more cells than pixels: wide steps do not hold those.
    pub(super) is_finer: bool,
}

impl RowCells {
    /// Makes these the cells for row `index_y` of the valid rectangle.
    #[inline(always)]
    pub(super) fn update(&mut self, frame: &Frame<'_>, index_y: u32) {
        let carried = &frame.field.carried;
        let (y, way) = frame.map.y.before(index_y);
        let (above, below) = (carried.row(y), carried.row((y + 1).min(carried.height() - 1)));
        let (phase, way) = (frame.phase.q12(), way.cast_signed());
        let count = above.len();
        self.is_finer = frame.map.x.cells() > frame.map.x.pixels();
        for axis in [&mut self.xs, &mut self.ys] {
            axis.resize(count + LANES, 0);
        }
        #[cfg(target_arch = "x86_64")]
        let done = if has_avx2() {
            // SAFETY: the processor has AVX2, asked for just above.
            unsafe { avx2::interpolate([above, below], phase, way, [&mut self.xs, &mut self.ys]) }
        } else {
            0
        };
        #[cfg(not(target_arch = "x86_64"))]
        let done = 0;
        let cells = self.xs.iter_mut().zip(&mut self.ys).zip(above.iter().zip(below));
        for ((x, y), (above, below)) in cells.skip(done) {
            let shift = |v: i16| (i32::from(v) * phase + 256) >> 9;
            *x = lerp(shift(above[0]), shift(below[0]), way);
            *y = lerp(shift(above[1]), shift(below[1]), way);
        }
        for axis in [&mut self.xs, &mut self.ys] {
            let last = axis[count - 1];
            axis[count..].fill(last);
        }
    }

    /// The displacement of `pixels` pixels from `first` on, where it is the same.
    #[inline(always)]
    pub(super) fn shared(&self, frame: &Frame<'_>, first: u32, pixels: usize) -> Option<[i32; 2]> {
        let map = &frame.map.x;
        let (start, end) = (map.before(first).0, map.before(first + pixels as u32 - 1).0);
        let cells = start as usize..end as usize + 2;
        let shared = [self.xs[cells.start], self.ys[cells.start]];
        let cells = self.xs[cells.clone()].iter().zip(&self.ys[cells]);
        let differs = cells.fold(0, |differs, (x, y)| differs | (x ^ shared[0]) | (y ^ shared[1]));
        (differs == 0).then_some(shared)
    }

    /// (1): where `pixels` pixels from `first` on are read; anything where a bit of `broken` is set.
    #[inline(always)]
    pub(super) fn positions<'a>(
        &'a self,
        frame: &'a Frame<'a>,
        [first, index_y]: [u32; 2],
        pixels: usize,
        broken: u64,
    ) -> RowPositions<'a> {
        RowPositions {
            xs: &self.xs,
            ys: &self.ys,
            places: frame.map.x.before_each(first, pixels),
            p: frame.centre([first, index_y]),
            wanted: !broken,
        }
    }
}

/// Where some pixels of a row are read.
pub(super) struct RowPositions<'a> {
    /// Displacements of the cells.
    xs: &'a [i32],
    ys: &'a [i32],
    /// For each pixel the cell before it and the way to the next one.
    places: &'a [[u16; 2]],
    /// Centre of the first pixel, Q8.
    p: [i32; 2],
    /// A bit for each pixel that is used.
    wanted: u64,
}

impl Positions for RowPositions<'_> {
    #[inline(always)]
    fn at(&self, i: usize) -> [i32; 2] {
        let [cell, way] = self.places[i];
        let (cell, way) = (usize::from(cell), i32::from(way));
        let [dx, dy] = [self.xs, self.ys].map(|axis| lerp(axis[cell], axis[cell + 1], way));
        [self.p[0] + ((i as i32) << 8) - dx, self.p[1] - dy]
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    unsafe fn eight(&self, i: usize) -> [__m256i; 2] {
        // SAFETY: the caller has AVX2.
        unsafe { avx2::positions(self, i) }
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    unsafe fn sixteen(&self, i: usize) -> [__m512i; 2] {
        // SAFETY: the caller has AVX-512.
        unsafe { avx512::positions(self, i) }
    }

    #[inline(always)]
    fn wanted(&self, i: usize) -> u16 {
        (self.wanted >> i) as u16
    }
}

/// `a + ((b - a) way + 128) / 256`, rounded down. Displacements stay within 2^20, so nothing
/// overflows; in a smooth cell they differ by half a pixel at most.
#[inline(always)]
fn lerp(a: i32, b: i32, way: i32) -> i32 {
    a + (((b - a) * way + 128) >> 8)
}
