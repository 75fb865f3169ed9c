//! Interpolates the displacement of sixteen pixels at a time.
//!
//! The same as [`super::avx2`], in registers twice as wide. The caller asks the processor whether
//! it has what [`crate::simd`] means by AVX-512.

use std::arch::x86_64::{
    __m512i, _mm512_add_epi32, _mm512_and_si512, _mm512_loadu_si512, _mm512_madd_epi16,
    _mm512_permutexvar_epi32, _mm512_set1_epi32, _mm512_setr_epi32, _mm512_srai_epi32,
    _mm512_srli_epi32, _mm512_sub_epi32,
};

use super::{LANES, RowPositions};

/// [`super::lerp`] of sixteen, where `a` and `b` differ by less than 2^15.
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
fn lerp([a, b]: [__m512i; 2], way: __m512i) -> __m512i {
    // The low half of the difference times the way, the high half times 0.
    let part = _mm512_madd_epi16(_mm512_sub_epi32(b, a), way);
    _mm512_add_epi32(a, _mm512_srai_epi32(_mm512_add_epi32(part, _mm512_set1_epi32(128)), 8))
}

/// Displacements of sixteen pixels, whose cells are `cell` after the first of `cells`, `way` of the
/// way to the next one.
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
fn displacement(cells: &[i32], cell: __m512i, way: __m512i) -> __m512i {
    let around: &[i32; LANES + 1] =
        cells.first_chunk().expect("cells reach a step beyond the last");
    // SAFETY: both loads are of 16 of the 17 values of 32 bits, and need no alignment.
    let (left, right) = unsafe {
        (
            _mm512_loadu_si512(around.as_ptr().cast()),
            _mm512_loadu_si512(around.as_ptr().add(1).cast()),
        )
    };
    let pick = [_mm512_permutexvar_epi32(cell, left), _mm512_permutexvar_epi32(cell, right)];
    lerp(pick, way)
}

/// Where sixteen pixels from `i` on are read. Grids have at most as many cells as pixels.
///
/// # Panics
/// If there are fewer pixels.
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
pub(super) fn positions(row: &RowPositions<'_>, i: usize) -> [__m512i; 2] {
    let places: &[[u16; 2]; LANES] =
        row.places[i..].first_chunk().expect("there are 16 pixels from i on");
    let first = usize::from(places[0][0]);
    // SAFETY: `places` holds 16 times two values of 16 bits, and the load needs no alignment.
    let places = unsafe { _mm512_loadu_si512(places.as_ptr().cast()) };
    let cell = _mm512_and_si512(places, _mm512_set1_epi32(0xffff));
    let cell = _mm512_sub_epi32(cell, _mm512_set1_epi32(first as i32));
    let way = _mm512_srli_epi32(places, 16);
    let steps = _mm512_setr_epi32(
        0, 0x100, 0x200, 0x300, 0x400, 0x500, 0x600, 0x700, 0x800, 0x900, 0xa00, 0xb00, 0xc00,
        0xd00, 0xe00, 0xf00,
    );
    let x = _mm512_add_epi32(_mm512_set1_epi32(row.p[0] + ((i as i32) << 8)), steps);
    [
        _mm512_sub_epi32(x, displacement(&row.xs[first..], cell, way)),
        _mm512_sub_epi32(_mm512_set1_epi32(row.p[1]), displacement(&row.ys[first..], cell, way)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::has_avx512;
    use crate::testing::hash;
    use crate::warp::sample::Positions as _;

    const PIXELS: usize = 64;

    #[test]
    fn sixteen_positions_equal_those_one_by_one() {
        if !has_avx512() {
            return;
        }
        for case in 0..2000 {
            // Anywhere, and neighbours as far apart as products of 16 bits allow.
            let displacement = |i: usize, axis| {
                let middle = (hash(case, 0, axis) >> 11) as i32 - 0x10_0000;
                middle + (hash(case, i as u32, axis) >> 17) as i32
            };
            let [xs, ys] = [0, 1].map(|axis| {
                (0..2 * PIXELS + LANES).map(|i| displacement(i, axis)).collect::<Vec<_>>()
            });
            let first = (hash(case, 0, 2) % 64) as usize;
            let places: [[u16; 2]; PIXELS] = std::array::from_fn(|i| {
                let cell = first + i * (case as usize % 8) / 7;
                [cell as u16, (hash(case, i as u32, 3) & 0xff) as u16]
            });
            let row =
                RowPositions { xs: &xs, ys: &ys, places: &places, p: [700, -30], wanted: u64::MAX };
            for i in 0..=PIXELS - LANES {
                // SAFETY: the processor has AVX-512, asked for above.
                let together = unsafe { positions(&row, i) };
                // SAFETY: 16 values of 32 bits are as large as a register.
                let [xs, ys]: [[i32; LANES]; 2] = unsafe { std::mem::transmute(together) };
                for lane in 0..LANES {
                    assert_eq!([xs[lane], ys[lane]], row.at(i + lane), "case {case}, {i}, {lane}");
                }
            }
        }
    }
}
