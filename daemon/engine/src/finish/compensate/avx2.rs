//! Eight `rgba8` pixels at a time.
//!
//! Of in-between frames most pixels lie within the room of their sixteenth, where (2) of [`super`]
//! is the blur itself; where one of eight does not, and for keys where a pixel differs from its
//! blur, the tables are looked up. The caller asks the processor whether it has AVX2.

use std::arch::x86_64::{
    __m256i, _mm_setr_epi8, _mm256_add_epi16, _mm256_and_si256, _mm256_andnot_si256,
    _mm256_broadcastsi128_si256, _mm256_cmpeq_epi32, _mm256_i32gather_epi32, _mm256_loadu_si256,
    _mm256_max_epu8, _mm256_min_epu8, _mm256_movemask_epi8, _mm256_mullo_epi16, _mm256_or_si256,
    _mm256_packus_epi16, _mm256_set1_epi8, _mm256_set1_epi16, _mm256_set1_epi32,
    _mm256_set1_epi64x, _mm256_setr_epi8, _mm256_setzero_si256, _mm256_shuffle_epi8,
    _mm256_slli_epi32, _mm256_srai_epi16, _mm256_srli_epi16, _mm256_srli_epi32,
    _mm256_storeu_si256, _mm256_sub_epi16, _mm256_subs_epu8, _mm256_testz_si256,
    _mm256_unpackhi_epi8, _mm256_unpacklo_epi8,
};

use crate::color::Rgba8;
use crate::finish::lanes::Wide;
use crate::finish::lanes::avx2::expanded;
use crate::finish::selection::FULL;
use crate::finish::shares::ByteTables;

/// Pixels of one step.
const LANES: usize = 8;

/// (2) or (3) of a row, as many pixels as whole steps hold; returns their number.
#[target_feature(enable = "avx2")]
pub(super) fn row(
    tables: &ByteTables,
    is_key: bool,
    sums: &[<Rgba8 as Wide>::Lanes],
    weights: Option<&[u8]>,
    row: &mut [Rgba8],
) -> usize {
    let count = row.len() / LANES;
    let mut weights = weights.map(|weights| weights.as_chunks::<LANES>().0.iter());
    let room = Room::new(tables);
    for (step, texels) in row.chunks_exact_mut(LANES).enumerate() {
        let weight = match &mut weights {
            None => [FULL; LANES],
            Some(weights) => weights.next().copied().unwrap_or_default(),
        };
        if weight == [0; LANES] {
            continue;
        }
        // SAFETY: there are 8 pixels of 4 bytes, and the load needs no alignment.
        let original = unsafe { _mm256_loadu_si256(texels.as_ptr().cast()) };
        let mut blur = expanded(sums, LANES / 2 * step);
        if weight != [FULL; LANES] {
            blur = mixed(original, blur, weight);
        }
        let made =
            if is_key { key(tables, original, blur) } else { room.between(tables, original, blur) };
        // SAFETY: there are 8 pixels of 4 bytes, and the store needs no alignment.
        unsafe { _mm256_storeu_si256(texels.as_mut_ptr().cast(), made) };
    }
    count * LANES
}

/// (0)
#[inline]
#[target_feature(enable = "avx2")]
fn mixed(original: __m256i, blur: __m256i, weights: [u8; LANES]) -> __m256i {
    let four_of_each = _mm256_setr_epi8(
        0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 6, 7, 7,
        7, 7,
    );
    let weights = _mm256_set1_epi64x(u64::from_le_bytes(weights).cast_signed());
    let weights = _mm256_shuffle_epi8(weights, four_of_each);
    let zero = _mm256_setzero_si256();
    // |s - o| w + 64 is at most 255 * 128 + 64, inside 16 bits with a sign.
    let half = |original: __m256i, blur: __m256i, weights: __m256i| {
        let way = _mm256_mullo_epi16(_mm256_sub_epi16(blur, original), weights);
        let way = _mm256_srai_epi16(_mm256_add_epi16(way, _mm256_set1_epi16(64)), 7);
        _mm256_add_epi16(original, way)
    };
    let low = half(
        _mm256_unpacklo_epi8(original, zero),
        _mm256_unpacklo_epi8(blur, zero),
        _mm256_unpacklo_epi8(weights, zero),
    );
    let high = half(
        _mm256_unpackhi_epi8(original, zero),
        _mm256_unpackhi_epi8(blur, zero),
        _mm256_unpackhi_epi8(weights, zero),
    );
    _mm256_packus_epi16(low, high)
}

/// How far the blur may lie from the original before a table has to be asked.
struct Room {
    above: __m256i,
    below: __m256i,
}

impl Room {
    #[inline]
    #[target_feature(enable = "avx2")]
    fn new(tables: &ByteTables) -> Self {
        let [above, below] = tables.room.map(|room| {
            let twice = [room, room];
            // SAFETY: there are twice 16 bytes, and the load needs no alignment.
            unsafe { _mm256_loadu_si256(twice.as_ptr().cast()) }
        });
        Self { above, below }
    }

    /// (2)
    #[inline]
    #[target_feature(enable = "avx2")]
    fn between(&self, tables: &ByteTables, original: __m256i, blur: __m256i) -> __m256i {
        let alpha = _mm256_set1_epi32(0xff00_0000_u32.cast_signed());
        let blur =
            _mm256_or_si256(_mm256_and_si256(alpha, original), _mm256_andnot_si256(alpha, blur));
        let sixteenth = _mm256_and_si256(_mm256_srli_epi16(original, 4), _mm256_set1_epi8(15));
        let above = _mm256_shuffle_epi8(self.above, sixteenth);
        let below = _mm256_shuffle_epi8(self.below, sixteenth);
        let beyond = _mm256_or_si256(
            _mm256_subs_epu8(_mm256_subs_epu8(blur, original), above),
            _mm256_subs_epu8(_mm256_subs_epu8(original, blur), below),
        );
        if _mm256_testz_si256(beyond, beyond) == 1 {
            return blur;
        }
        let (mut low, mut high) =
            (_mm256_and_si256(alpha, original), _mm256_and_si256(alpha, original));
        for (channel, shift) in [0, 8, 16].into_iter().enumerate() {
            let level = match shift {
                0 => original,
                8 => _mm256_srli_epi32(original, 8),
                _ => _mm256_srli_epi32(original, 16),
            };
            let index = _mm256_and_si256(level, _mm256_set1_epi32(0xff));
            let within = tables.within[channel].as_ptr().cast();
            // SAFETY: an index has 8 bits, and there are 256 entries of 4 bytes.
            let ends = unsafe { _mm256_i32gather_epi32::<4>(within, index) };
            let first = _mm256_and_si256(ends, _mm256_set1_epi32(0xff));
            let last = _mm256_srli_epi32(ends, 8);
            let place = |level| match shift {
                0 => level,
                8 => _mm256_slli_epi32(level, 8),
                _ => _mm256_slli_epi32(level, 16),
            };
            low = _mm256_or_si256(low, place(first));
            high = _mm256_or_si256(high, place(last));
        }
        _mm256_min_epu8(_mm256_max_epu8(blur, low), high)
    }
}

/// (3)
#[inline]
#[target_feature(enable = "avx2")]
fn key(tables: &ByteTables, original: __m256i, blur: __m256i) -> __m256i {
    let alpha = _mm256_set1_epi32(0xff00_0000_u32.cast_signed());
    let same =
        _mm256_cmpeq_epi32(_mm256_andnot_si256(alpha, original), _mm256_andnot_si256(alpha, blur));
    if _mm256_movemask_epi8(same) == -1 {
        return original;
    }
    // Of each channel the original in the upper byte of 16 bits and the blur in the lower.
    let red = _mm256_shuffle_epi8(original, spread(0));
    let green = _mm256_shuffle_epi8(original, spread(1));
    let blue = _mm256_shuffle_epi8(original, spread(2));
    let mut made = _mm256_and_si256(alpha, original);
    for (channel, original) in [red, green, blue].into_iter().enumerate() {
        let byte = _mm256_set1_epi32(0xff);
        let (level, blurred) = match channel {
            0 => (original, _mm256_and_si256(blur, byte)),
            1 => (original, _mm256_and_si256(_mm256_srli_epi32(blur, 8), byte)),
            _ => (original, _mm256_and_si256(_mm256_srli_epi32(blur, 16), byte)),
        };
        let index = _mm256_or_si256(level, blurred);
        let key = tables.key[channel].as_ptr().cast();
        // SAFETY: an index has 16 bits, and there are 3 bytes behind the entry of the largest.
        let found = unsafe { _mm256_i32gather_epi32::<1>(key, index) };
        let found = _mm256_and_si256(found, byte);
        let found = match channel {
            0 => found,
            1 => _mm256_slli_epi32(found, 8),
            _ => _mm256_slli_epi32(found, 16),
        };
        made = _mm256_or_si256(made, found);
    }
    made
}

/// The shuffle that moves byte `channel` of each pixel to the second byte, alone.
#[inline]
#[target_feature(enable = "avx2")]
fn spread(channel: i8) -> __m256i {
    let at = |pixel: i8| 4 * pixel + channel;
    _mm256_broadcastsi128_si256(_mm_setr_epi8(
        -1,
        at(0),
        -1,
        -1,
        -1,
        at(1),
        -1,
        -1,
        -1,
        at(2),
        -1,
        -1,
        -1,
        at(3),
        -1,
        -1,
    ))
}
