//! Interpolates the displacement of eight pixels at a time.
//!
//! A grid has at most as many cells as pixels, so the cells before eight pixels in a row lie among
//! eight: one load holds them, one more their right neighbours, and a permutation picks. The
//! caller asks the processor whether it has AVX2.

use std::arch::x86_64::{
    __m256i, _mm256_add_epi32, _mm256_and_si256, _mm256_loadu_si256, _mm256_mullo_epi32,
    _mm256_permutevar8x32_epi32, _mm256_set1_epi32, _mm256_setr_epi32, _mm256_srai_epi32,
    _mm256_srli_epi32, _mm256_sub_epi32,
};

use super::{BlockPositions, CELLS, LANES};

/// Where eight pixels from `i` on are read. Grids have at most as many cells as pixels.
///
/// # Panics
/// If the block has fewer pixels.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn positions(block: &BlockPositions<'_>, i: usize) -> [__m256i; 2] {
    let places: &[[u16; 2]; LANES] =
        block.places[i..].first_chunk().expect("the block has 8 pixels from i on");
    let first = usize::from(places[0][0]);
    // SAFETY: `places` holds 8 times two values of 16 bits, and the load needs no alignment.
    let places = unsafe { _mm256_loadu_si256(places.as_ptr().cast()) };
    let cell = _mm256_and_si256(places, _mm256_set1_epi32(0xffff));
    let cell = _mm256_sub_epi32(cell, _mm256_set1_epi32(first as i32));
    let way = _mm256_srli_epi32(places, 16);
    let displacement = |cells: &[i32; CELLS]| {
        let around: &[i32; LANES + 1] = cells[first - block.start..]
            .first_chunk()
            .expect("cells reach a step beyond the block");
        // SAFETY: both loads are of 8 of the 9 values of 32 bits, and need no alignment.
        let (left, right) = unsafe {
            (
                _mm256_loadu_si256(around.as_ptr().cast()),
                _mm256_loadu_si256(around.as_ptr().add(1).cast()),
            )
        };
        let left = _mm256_permutevar8x32_epi32(left, cell);
        let right = _mm256_permutevar8x32_epi32(right, cell);
        let part = _mm256_mullo_epi32(_mm256_sub_epi32(right, left), way);
        let part = _mm256_srai_epi32(_mm256_add_epi32(part, _mm256_set1_epi32(128)), 8);
        _mm256_add_epi32(left, part)
    };
    let steps = _mm256_setr_epi32(0, 0x100, 0x200, 0x300, 0x400, 0x500, 0x600, 0x700);
    let x = _mm256_add_epi32(_mm256_set1_epi32(block.p[0] + ((i as i32) << 8)), steps);
    [
        _mm256_sub_epi32(x, displacement(&block.cells[0])),
        _mm256_sub_epi32(_mm256_set1_epi32(block.p[1]), displacement(&block.cells[1])),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::{BLOCK, Positions as _};
    use super::*;
    use crate::testing::hash;

    #[test]
    fn eight_positions_equal_those_one_by_one() {
        if !is_x86_feature_detected!("avx2") {
            return;
        }
        for case in 0..2000 {
            let displacement =
                |i: usize, axis| (hash(case, i as u32, axis) >> 11) as i32 - 0x10_0000;
            let cells = [0, 1].map(|axis| std::array::from_fn(|i| displacement(i, axis)));
            let (start, first) = (5, (hash(case, 0, 2) % 64) as usize);
            let places: [[u16; 2]; BLOCK] = std::array::from_fn(|i| {
                let cell = start + (first + i * (case as usize % 8) / 7).min(BLOCK);
                [cell as u16, (hash(case, i as u32, 3) & 0xff) as u16]
            });
            let block = BlockPositions { cells: &cells, start, places: &places, p: [700, -30] };
            for i in 0..=BLOCK - LANES {
                // SAFETY: the processor has AVX2, asked for above.
                let together = unsafe { positions(&block, i) };
                // SAFETY: 8 values of 32 bits are as large as a register.
                let [xs, ys]: [[i32; LANES]; 2] = unsafe { std::mem::transmute(together) };
                for lane in 0..LANES {
                    assert_eq!(
                        [xs[lane], ys[lane]],
                        block.at(i + lane),
                        "case {case}, {i}, {lane}"
                    );
                }
            }
        }
    }
}
