//! Interpolates the displacement of eight pixels at a time.
//!
//! A grid has at most as many cells as pixels, so the cells before eight pixels in a row lie among
//! eight: one load holds them, one more their right neighbours, and a permutation picks. The
//! caller asks the processor whether it has AVX2.

use std::arch::x86_64::{
    __m256i, _mm256_add_epi32, _mm256_and_si256, _mm256_andnot_si256, _mm256_loadu_si256,
    _mm256_madd_epi16, _mm256_permutevar8x32_epi32, _mm256_set1_epi32, _mm256_setr_epi32,
    _mm256_srai_epi32, _mm256_srli_epi32, _mm256_storeu_si256, _mm256_sub_epi32,
};

use super::RowPositions;

/// Pixels of one step.
const LANES: usize = 8;

/// Displacements of the cells of two rows at `phase`, Q12, interpolated `way` of the way from the
/// first to the second, into `xs` and `ys`, as many as whole steps hold; returns their number.
/// Those that differ by 2^15 or more from row to row come out as anything.
///
/// # Panics
/// If the rows are not of one length, or `moved` is shorter.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn interpolate(
    rows: [&[[i16; 2]]; 2],
    phase: i32,
    way: i32,
    [xs, ys]: [&mut [i32]; 2],
) -> usize {
    let (low, way) = (_mm256_set1_epi32(0xffff), _mm256_set1_epi32(way));
    // A phase is at most 16384: products of 16 bits hold it.
    let phase = _mm256_set1_epi32(phase | phase << 16);
    let moved = |v: __m256i| {
        let product = _mm256_madd_epi16(v, phase);
        _mm256_srai_epi32(_mm256_add_epi32(product, _mm256_set1_epi32(256)), 9)
    };
    let [above, below] = rows.map(|row| row.as_chunks::<LANES>().0);
    assert_eq!(above.len(), below.len(), "rows of one length");
    let (xs, ys) = (xs.as_chunks_mut::<LANES>().0, ys.as_chunks_mut::<LANES>().0);
    let (xs, ys) = (&mut xs[..above.len()], &mut ys[..above.len()]);
    for (i, (above, below)) in above.iter().zip(below).enumerate() {
        // SAFETY: each holds 8 times two values of 16 bits, and the loads need no alignment.
        let rows = [above, below].map(|row| unsafe { _mm256_loadu_si256(row.as_ptr().cast()) });
        let x = lerp(rows.map(|v| moved(_mm256_and_si256(v, low))), way);
        let y = lerp(rows.map(|v| moved(_mm256_andnot_si256(low, v))), way);
        // SAFETY: both hold 8 values of 32 bits, and the stores need no alignment.
        unsafe {
            _mm256_storeu_si256(xs[i].as_mut_ptr().cast(), x);
            _mm256_storeu_si256(ys[i].as_mut_ptr().cast(), y);
        }
    }
    above.len() * LANES
}

/// [`super::lerp`] of eight, where `a` and `b` differ by less than 2^15.
#[inline]
#[target_feature(enable = "avx2")]
fn lerp([a, b]: [__m256i; 2], way: __m256i) -> __m256i {
    // The low half of the difference times the way, the high half times 0.
    let part = _mm256_madd_epi16(_mm256_sub_epi32(b, a), way);
    _mm256_add_epi32(a, _mm256_srai_epi32(_mm256_add_epi32(part, _mm256_set1_epi32(128)), 8))
}

/// Where eight pixels from `i` on are read. Grids have at most as many cells as pixels.
///
/// # Panics
/// If there are fewer pixels.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn positions(row: &RowPositions<'_>, i: usize) -> [__m256i; 2] {
    let places: &[[u16; 2]; LANES] =
        row.places[i..].first_chunk().expect("there are 8 pixels from i on");
    let first = usize::from(places[0][0]);
    // SAFETY: `places` holds 8 times two values of 16 bits, and the load needs no alignment.
    let places = unsafe { _mm256_loadu_si256(places.as_ptr().cast()) };
    let cell = _mm256_and_si256(places, _mm256_set1_epi32(0xffff));
    let cell = _mm256_sub_epi32(cell, _mm256_set1_epi32(first as i32));
    let way = _mm256_srli_epi32(places, 16);
    let displacement = |cells: &[i32]| {
        let around: &[i32; LANES + 1] =
            cells[first..].first_chunk().expect("cells reach a step beyond the last");
        // SAFETY: both loads are of 8 of the 9 values of 32 bits, and need no alignment.
        let (left, right) = unsafe {
            (
                _mm256_loadu_si256(around.as_ptr().cast()),
                _mm256_loadu_si256(around.as_ptr().add(1).cast()),
            )
        };
        let left = _mm256_permutevar8x32_epi32(left, cell);
        let right = _mm256_permutevar8x32_epi32(right, cell);
        lerp([left, right], way)
    };
    let steps = _mm256_setr_epi32(0, 0x100, 0x200, 0x300, 0x400, 0x500, 0x600, 0x700);
    let x = _mm256_add_epi32(_mm256_set1_epi32(row.p[0] + ((i as i32) << 8)), steps);
    [
        _mm256_sub_epi32(x, displacement(row.xs)),
        _mm256_sub_epi32(_mm256_set1_epi32(row.p[1]), displacement(row.ys)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::hash;
    use crate::warp::sample::Positions as _;

    const PIXELS: usize = 64;

    #[test]
    fn eight_positions_equal_those_one_by_one() {
        if !is_x86_feature_detected!("avx2") {
            return;
        }
        for case in 0..2000 {
            // Anywhere, and neighbours as far apart as products of 16 bits allow.
            let displacement = |i: usize, axis| {
                let middle = (hash(case, 0, axis) >> 11) as i32 - 0x10_0000;
                middle + (hash(case, i as u32, axis) >> 17) as i32
            };
            let [xs, ys] = [0, 1]
                .map(|axis| (0..2 * PIXELS + 8).map(|i| displacement(i, axis)).collect::<Vec<_>>());
            let first = (hash(case, 0, 2) % 64) as usize;
            let places: [[u16; 2]; PIXELS] = std::array::from_fn(|i| {
                let cell = first + i * (case as usize % 8) / 7;
                [cell as u16, (hash(case, i as u32, 3) & 0xff) as u16]
            });
            let row =
                RowPositions { xs: &xs, ys: &ys, places: &places, p: [700, -30], wanted: u64::MAX };
            for i in 0..=PIXELS - LANES {
                // SAFETY: the processor has AVX2, asked for above.
                let together = unsafe { positions(&row, i) };
                // SAFETY: 8 values of 32 bits are as large as a register.
                let [xs, ys]: [[i32; LANES]; 2] = unsafe { std::mem::transmute(together) };
                for lane in 0..LANES {
                    assert_eq!([xs[lane], ys[lane]], row.at(i + lane), "case {case}, {i}, {lane}");
                }
            }
        }
    }
}
