//! Eight target cells at a time look at their sources.
//!
//! The caller asks the processor whether it has AVX2.

use std::arch::x86_64::{
    __m256i, _mm256_abs_epi32, _mm256_add_epi32, _mm256_and_si256, _mm256_andnot_si256,
    _mm256_cmpeq_epi32, _mm256_cmpgt_epi32, _mm256_loadu_si256, _mm256_madd_epi16,
    _mm256_max_epu32, _mm256_min_epu32, _mm256_or_si256, _mm256_set1_epi32, _mm256_setr_epi32,
    _mm256_setzero_si256, _mm256_slli_epi32, _mm256_srai_epi32, _mm256_srli_epi32,
    _mm256_storeu_si256, _mm256_sub_epi32,
};

use std::cell::RefCell;

use super::{COLUMNS, Target, source_rows};
use crate::key::Velocity;
use crate::warp::scatter::SOURCE_BITS;
use crate::warp::scatter::tiles::Window;

/// Target cells of one step.
const LANES: usize = 8;

/// Steps of a row of a tile.
const STEPS: usize = COLUMNS / LANES;

/// A row of source cells as candidates for a row of target cells.
struct Row<'a> {
    velocities: &'a [Velocity],
    depths: &'a [u32],
    /// Number of the first cell.
    first: u32,
    /// From the target cells to them, Q8 cells.
    away: [i32; 2],
}

/// [`super::look`], where all source cells of the window lie inside the grid and the tile is made
/// of whole steps. False, with nothing done, where they do not.
#[target_feature(enable = "avx2")]
pub(super) fn look(target: &Target<'_>, window: &Window, splat: &mut [u32]) -> bool {
    let width = target.source.velocity.width();
    let (start, end) = (target.start[0] as usize, target.end[0] as usize);
    let moved = window.fewest[0]..window.most[0] + 2;
    let is_inside = start.checked_add_signed(1 - moved.end as isize).is_some()
        && end.checked_add_signed(-(moved.start as isize)).is_some_and(|end| end <= width as usize);
    // Scales of more than 15 bits belong to grids much finer than colour.
    let has_scale = target.scale.iter().all(|scale| i16::try_from(*scale).is_ok());
    if !is_inside || !has_scale || !(end - start).is_multiple_of(LANES) {
        return false;
    }
    let scale = target.scale.map(|scale| _mm256_set1_epi32(scale | scale << 16));
    // Of each candidate: the depth key, 0 where it does not land, and the rank, all ones there.
    let mut found = FOUND.take();
    found.resize(window.candidates().max(found.len()), [[_mm256_setzero_si256(); 2]; STEPS]);
    for (splat, y) in splat.chunks_mut(width as usize).zip(target.start[1]..target.end[1]) {
        let mut count = 0;
        let mut top = [_mm256_setzero_si256(); STEPS];
        for source_y in source_rows(target, window, y) {
            for moved in moved.clone() {
                let cells = start.wrapping_add_signed(-(moved as isize))
                    ..end.wrapping_add_signed(-(moved as isize));
                let row = Row {
                    first: source_y * width + cells.start as u32,
                    velocities: &target.source.velocity.row(source_y)[cells.clone()],
                    depths: &target.source.depth.row(source_y)[cells],
                    away: [-moved << 8, (source_y.cast_signed() - y.cast_signed()) << 8],
                };
                row.look(scale, &mut top, &mut found[count]);
                count += 1;
            }
        }
        let eights = splat[start..end].as_chunks_mut::<LANES>().0;
        for (step, (splat, top)) in eights.iter_mut().zip(top).enumerate() {
            let limit = _mm256_sub_epi32(top, _mm256_srli_epi32(top, 8));
            let mut best = _mm256_set1_epi32(-1);
            for found in &found[..count] {
                let [depth, rank] = found[step];
                let is_near = _mm256_cmpeq_epi32(_mm256_max_epu32(depth, limit), depth);
                best = _mm256_min_epu32(best, or_ones(rank, is_near));
            }
            // SAFETY: there are 8 values of 32 bits, and the store needs no alignment.
            unsafe { _mm256_storeu_si256(splat.as_mut_ptr().cast(), best) };
        }
    }
    FOUND.set(found);
    true
}

thread_local! {
    /// Kept from tile to tile.
    static FOUND: RefCell<Vec<[[__m256i; 2]; STEPS]>> = const { RefCell::new(Vec::new()) };
}

impl Row<'_> {
    /// Depth keys and ranks into `found`; `top` is raised to the largest depth keys.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn look(
        &self,
        scale: [__m256i; 2],
        top: &mut [__m256i; STEPS],
        found: &mut [[__m256i; 2]; STEPS],
    ) {
        let low = _mm256_set1_epi32(0xffff);
        // (v scale + 256) >> 9, and from there to the target cell.
        let from = self.away.map(|away| _mm256_set1_epi32(256 + (away << 9)));
        let distance = |v: __m256i, axis: usize| {
            let moved = _mm256_add_epi32(_mm256_madd_epi16(v, scale[axis]), from[axis]);
            _mm256_abs_epi32(_mm256_srai_epi32(moved, 9))
        };
        let mut cell = _mm256_add_epi32(
            _mm256_set1_epi32(self.first.cast_signed()),
            _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7),
        );
        let sources = self.velocities.as_chunks::<LANES>().0.iter();
        let sources = sources.zip(self.depths.as_chunks::<LANES>().0);
        for ((velocity, depth), (top, found)) in sources.zip(top.iter_mut().zip(found)) {
            // SAFETY: both are of 8 values of 32 bits, and the loads need no alignment.
            let (velocity, depth) = unsafe {
                (
                    _mm256_loadu_si256(velocity.as_ptr().cast()),
                    _mm256_loadu_si256(depth.as_ptr().cast()),
                )
            };
            let x = distance(_mm256_and_si256(velocity, low), 0);
            let y = distance(_mm256_andnot_si256(low, velocity), 1);
            let lands = _mm256_cmpgt_epi32(_mm256_set1_epi32(256), _mm256_or_si256(x, y));
            let quarter = _mm256_srli_epi32(_mm256_add_epi32(x, y), 2);
            let rank = _mm256_or_si256(_mm256_slli_epi32(quarter, SOURCE_BITS as i32), cell);
            let depth = _mm256_and_si256(depth, lands);
            *found = [depth, or_ones(rank, lands)];
            *top = _mm256_max_epu32(*top, depth);
            cell = _mm256_add_epi32(cell, _mm256_set1_epi32(LANES as i32));
        }
    }
}

/// `value` where `mask` is set, else all ones.
#[inline]
#[target_feature(enable = "avx2")]
fn or_ones(value: __m256i, mask: __m256i) -> __m256i {
    _mm256_or_si256(value, _mm256_andnot_si256(mask, _mm256_set1_epi32(-1)))
}
