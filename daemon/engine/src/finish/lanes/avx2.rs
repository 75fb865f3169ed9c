//! The sums of a row of `rgba8` pixels, four at a time.
//!
//! The caller asks the processor whether it has AVX2.

use std::arch::x86_64::{
    __m256i, _mm_loadu_si128, _mm256_add_epi16, _mm256_cvtepu8_epi16, _mm256_loadu_si256,
    _mm256_mullo_epi16, _mm256_packus_epi16, _mm256_permute4x64_epi64, _mm256_set1_epi16,
    _mm256_slli_epi16, _mm256_srli_epi16, _mm256_storeu_si256, _mm256_unpackhi_epi64,
    _mm256_unpacklo_epi64,
};

use super::Packed;
use crate::color::Rgba8;

/// Pixels whose sums fill a register.
const SUMS: usize = 4;
/// Pixels of a step that makes pixels.
const LANES: usize = 8;

/// [`super::Wide::weigh`] of as many columns as whole steps hold; returns their number.
#[target_feature(enable = "avx2")]
pub(super) fn weigh(rows: [&[Rgba8]; 3], weights: [u32; 3], sums: &mut [Packed]) -> usize {
    let [above, here, below] = rows.map(|row| row.as_chunks::<SUMS>().0);
    let weights = weights.map(|weight| _mm256_set1_epi16(weight as i16));
    let sums = sums.as_chunks_mut::<SUMS>().0;
    let steps = above.len().min(here.len()).min(below.len()).min(sums.len());
    for (((above, here), below), sum) in above.iter().zip(here).zip(below).zip(&mut *sums) {
        let mut total = _mm256_set1_epi16(0);
        for (pixels, weight) in [above, here, below].into_iter().zip(weights) {
            // SAFETY: there are 4 pixels of 4 bytes, and the load needs no alignment.
            let bytes = unsafe { _mm_loadu_si128(pixels.as_ptr().cast()) };
            let weighed = _mm256_mullo_epi16(_mm256_cvtepu8_epi16(bytes), weight);
            total = _mm256_add_epi16(total, weighed);
        }
        // SAFETY: there are 4 sums of 8 bytes, and the store needs no alignment.
        unsafe { _mm256_storeu_si256(sum.as_mut_ptr().cast(), total) };
    }
    steps * SUMS
}

/// Four sums from `place` on.
///
/// # Panics
/// If there are not as many.
#[inline]
#[target_feature(enable = "avx2")]
fn four(sums: &[Packed], place: usize) -> __m256i {
    let four = &sums[place..place + SUMS];
    // SAFETY: there are 4 sums of 8 bytes, and the load needs no alignment.
    unsafe { _mm256_loadu_si256(four.as_ptr().cast()) }
}

/// [`super::Wide::halve`] of as many pixels as whole steps hold; returns their number.
#[target_feature(enable = "avx2")]
pub(super) fn halve(sums: &[Packed], row: &mut [Rgba8]) -> usize {
    // A step reads a sum more than it needs.
    let steps = (row.len() / LANES).min(sums.len().saturating_sub(2) / (2 * LANES));
    for (step, texels) in row.as_chunks_mut::<LANES>().0.iter_mut().enumerate().take(steps) {
        let place = 2 * LANES * step;
        let made = _mm256_packus_epi16(halved(sums, place), halved(sums, place + LANES));
        // Pixels 0 1 4 5 | 2 3 6 7 become 0 1 2 3 | 4 5 6 7.
        let made = _mm256_permute4x64_epi64::<0b11_01_10_00>(made);
        // SAFETY: there are 8 pixels of 4 bytes, and the store needs no alignment.
        unsafe { _mm256_storeu_si256(texels.as_mut_ptr().cast(), made) };
    }
    steps * LANES
}

/// Four pixels of every second column from `place` on, 16 bits a channel.
#[inline]
#[target_feature(enable = "avx2")]
fn halved(sums: &[Packed], place: usize) -> __m256i {
    let [first, second] = [place, place + SUMS].map(
        #[inline]
        |place| {
            let here = _mm256_slli_epi16(four(sums, place + 1), 1);
            _mm256_add_epi16(_mm256_add_epi16(four(sums, place), here), four(sums, place + 2))
        },
    );
    // Of either, columns 0 and 2 count: 0 0' | 2 2' become 0 2 | 0' 2'.
    let columns = _mm256_permute4x64_epi64::<0b11_01_10_00>(_mm256_unpacklo_epi64(first, second));
    _mm256_srli_epi16(_mm256_add_epi16(columns, _mm256_set1_epi16(8)), 4)
}

/// [`super::Wide::expand`] of as many pixels as whole steps hold; returns their number.
#[target_feature(enable = "avx2")]
pub(super) fn expand(sums: &[Packed], row: &mut [Rgba8]) -> usize {
    let steps = (row.len() / LANES).min(sums.len().saturating_sub(2) / SUMS);
    for (step, texels) in row.as_chunks_mut::<LANES>().0.iter_mut().enumerate().take(steps) {
        let made = expanded(sums, SUMS * step);
        // SAFETY: there are 8 pixels of 4 bytes, and the store needs no alignment.
        unsafe { _mm256_storeu_si256(texels.as_mut_ptr().cast(), made) };
    }
    steps * LANES
}

/// Eight pixels of four columns from `place` on, of which the next sum is the first.
///
/// # Panics
/// If there are not six sums from `place` on.
#[inline]
#[target_feature(enable = "avx2")]
pub(in crate::finish) fn expanded(sums: &[Packed], place: usize) -> __m256i {
    let [before, here, after] = [0, 1, 2].map(
        #[inline]
        |tap| four(sums, place + tap),
    );
    let half = _mm256_set1_epi16(32);
    let here_4 = _mm256_slli_epi16(here, 2);
    let here_6 = _mm256_add_epi16(here_4, _mm256_slli_epi16(here, 1));
    let even = _mm256_add_epi16(_mm256_add_epi16(before, here_6), after);
    let odd = _mm256_add_epi16(here_4, _mm256_slli_epi16(after, 2));
    let even = _mm256_srli_epi16(_mm256_add_epi16(even, half), 6);
    let odd = _mm256_srli_epi16(_mm256_add_epi16(odd, half), 6);
    // Pixels 0 2 | 4 6 and 1 3 | 5 7 become 0 1 2 3 | 4 5 6 7.
    let low = _mm256_unpacklo_epi64(even, odd);
    let high = _mm256_unpackhi_epi64(even, odd);
    _mm256_packus_epi16(low, high)
}
