//! Interpolation of all channels of an `rgba8` pixel at once.
//!
//! SSE2 is part of x86-64, so nothing has to be detected at run time. The result is that of
//! `Rgba8::bilinear_by_channel`, which other machines use.

use std::arch::x86_64::{
    _mm_add_epi16, _mm_add_epi32, _mm_cvtsi64_si128, _mm_cvtsi128_si32, _mm_madd_epi16,
    _mm_mullo_epi16, _mm_packs_epi32, _mm_packus_epi16, _mm_set1_epi16, _mm_set1_epi32,
    _mm_setzero_si128, _mm_srli_epi32, _mm_unpackhi_epi64, _mm_unpacklo_epi8, _mm_unpacklo_epi16,
    _mm_unpacklo_epi64, _mm_xor_si128,
};

/// Across first, exact in 16
/// bits (255 * 256), then down, exact in 32; so no rounding differs from the four weights at once.
#[inline]
#[target_feature(enable = "sse2")]
pub(super) fn bilinear_rgba8(corners: [u32; 4], fx: u32, fy: u32) -> u32 {
    let [top_left, top_right, bottom_left, bottom_right] = corners.map(u64::from);
    let zero = _mm_setzero_si128();
    let pair = |left: u64, right: u64| {
        _mm_unpacklo_epi8(_mm_cvtsi64_si128((left | right << 32).cast_signed()), zero)
    };
    let weight = |weight: u32| _mm_set1_epi16(weight as i16);
    let across = _mm_unpacklo_epi64(weight(256 - fx), weight(fx));
    let row = |left: u64, right: u64| {
        let weighed = _mm_mullo_epi16(pair(left, right), across);
        _mm_add_epi16(weighed, _mm_unpackhi_epi64(weighed, weighed))
    };
    // The multiplication is of signed numbers: half the range is taken off and put back.
    let rows = _mm_unpacklo_epi16(row(top_left, top_right), row(bottom_left, bottom_right));
    let centred = _mm_xor_si128(rows, _mm_set1_epi16(i16::MIN));
    let down = _mm_unpacklo_epi16(weight(256 - fy), weight(fy));
    let sum = _mm_madd_epi16(centred, down);
    let rounded = _mm_srli_epi32(_mm_add_epi32(sum, _mm_set1_epi32(32768 * 256 + 32768)), 16);
    let words = _mm_packs_epi32(rounded, rounded);
    _mm_cvtsi128_si32(_mm_packus_epi16(words, words)).cast_unsigned()
}
