//! Reads the velocities of eight cells at a time.
//!
//! The caller asks the processor whether it has AVX2.

use std::arch::x86_64::{
    _mm256_and_si256, _mm256_andnot_si256, _mm256_blendv_epi8, _mm256_cmpeq_epi32,
    _mm256_cmpgt_epi32, _mm256_i32gather_epi32, _mm256_loadu_si256, _mm256_min_epi32,
    _mm256_movemask_epi8, _mm256_or_si256, _mm256_set1_epi32, _mm256_storeu_si256,
};

use super::HOLE;
use crate::key::Velocity;
use crate::warp::scatter::{MAX_CELLS, NO_SOURCE};

/// Cells of one step.
const LANES: usize = 8;

/// (1) for a row of splats, as many as whole steps hold; returns their number.
///
/// # Panics
/// If the rows are not of one length, there are no velocities, or a splat names a source beyond
/// them.
#[target_feature(enable = "avx2")]
pub(super) fn resolve(velocities: &[Velocity], splats: &[u32], carried: &mut [[i16; 2]]) -> usize {
    assert_eq!(splats.len(), carried.len(), "rows of one length");
    assert!(!velocities.is_empty(), "a grid has cells");
    let last = i32::try_from(velocities.len()).expect("a grid has at most 2^25 cells") - 1;
    let last = _mm256_set1_epi32(last);
    let hole = _mm256_set1_epi32(zerocopy::transmute!(HOLE));
    let splats = splats.as_chunks::<LANES>().0;
    let mut is_beyond = _mm256_set1_epi32(0);
    for (splat, carried) in splats.iter().zip(carried.as_chunks_mut::<LANES>().0) {
        // SAFETY: there are 8 values of 32 bits, and the load needs no alignment.
        let splat = unsafe { _mm256_loadu_si256(splat.as_ptr().cast()) };
        let is_hole = _mm256_cmpeq_epi32(splat, _mm256_set1_epi32(NO_SOURCE.cast_signed()));
        let source = _mm256_and_si256(splat, _mm256_set1_epi32(MAX_CELLS.cast_signed()));
        let beyond = _mm256_andnot_si256(is_hole, _mm256_cmpgt_epi32(source, last));
        is_beyond = _mm256_or_si256(is_beyond, beyond);
        let source = _mm256_min_epi32(source, last);
        // SAFETY: 25 bits are not below 0, and nothing is beyond the last velocity, of which there
        // is one; it has 4 bytes.
        let velocity = unsafe { _mm256_i32gather_epi32::<4>(velocities.as_ptr().cast(), source) };
        let shown = _mm256_blendv_epi8(velocity, hole, is_hole);
        // SAFETY: there are 8 times two values of 16 bits, and the store needs no alignment.
        unsafe { _mm256_storeu_si256(carried.as_mut_ptr().cast(), shown) };
    }
    assert_eq!(_mm256_movemask_epi8(is_beyond), 0, "every source is a cell of the grid");
    splats.len() * LANES
}
