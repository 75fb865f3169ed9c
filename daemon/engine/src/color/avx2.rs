//! Reads eight `rgba8` pixels at a time between their neighbours.
//!
//! The same arithmetic as [`super::sse2`], in both halves of a register, behind the clamp of
//! [`crate::warp::sample`]. The caller asks the processor whether it has AVX2.

use std::arch::x86_64::{
    __m256i, _mm256_add_epi16, _mm256_add_epi32, _mm256_and_si256, _mm256_andnot_si256,
    _mm256_cvtsi256_si32, _mm256_i32gather_epi32, _mm256_loadu_si256, _mm256_madd_epi16,
    _mm256_maddubs_epi16, _mm256_max_epi32, _mm256_min_epi32, _mm256_mullo_epi16,
    _mm256_mullo_epi32, _mm256_or_si256, _mm256_packs_epi32, _mm256_packus_epi16,
    _mm256_permutevar8x32_epi32, _mm256_set1_epi16, _mm256_set1_epi32, _mm256_setr_epi32,
    _mm256_setzero_si256, _mm256_shuffle_epi32, _mm256_slli_epi32, _mm256_srai_epi32,
    _mm256_srli_epi16, _mm256_srli_epi32, _mm256_storeu_si256, _mm256_sub_epi32,
    _mm256_testz_si256, _mm256_unpackhi_epi8, _mm256_unpackhi_epi16, _mm256_unpackhi_epi32,
    _mm256_unpacklo_epi8, _mm256_unpacklo_epi16, _mm256_unpacklo_epi32, _mm256_xor_si256,
};

use super::Rgba8;
use crate::plane::{Plane, Rect};
use crate::warp::sample::Positions;

/// Pixels of one step.
pub(super) const LANES: usize = 8;

/// One axis of a valid rectangle.
struct Axis {
    first: __m256i,
    last: __m256i,
    last_pixel: __m256i,
}

/// One axis of eight positions: the pixel before, the pixel after, the way between them.
struct Between {
    low: __m256i,
    high: __m256i,
    way: __m256i,
}

impl Axis {
    #[inline]
    #[target_feature(enable = "avx2")]
    fn new(start: u32, length: u32) -> Self {
        let last_pixel = (start + length - 1).cast_signed();
        Self {
            first: _mm256_set1_epi32((start << 8).cast_signed()),
            last: _mm256_set1_epi32(last_pixel << 8),
            last_pixel: _mm256_set1_epi32(last_pixel),
        }
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn between(&self, position: __m256i) -> Between {
        let clamped = _mm256_min_epi32(_mm256_max_epi32(position, self.first), self.last);
        let low = _mm256_srai_epi32(clamped, 8);
        let next = _mm256_add_epi32(low, _mm256_set1_epi32(1));
        Between {
            low,
            high: _mm256_min_epi32(next, self.last_pixel),
            way: _mm256_and_si256(clamped, _mm256_set1_epi32(0xff)),
        }
    }
}

/// The colours of `plane` at `positions`, clamped to `valid`, into `out`, as many as whole steps
/// hold; returns their number.
///
/// # Panics
/// If `valid` does not lie inside the plane, or the plane has 2^31 pixels or more, or 2^23 along
/// an axis.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn sample_each(
    plane: &Plane<Rgba8>,
    valid: Rect,
    positions: &impl Positions,
    out: &mut [Rgba8],
) -> usize {
    assert!(valid.fits(plane.width(), plane.height()), "the valid rectangle lies inside the plane");
    assert!(i32::try_from(plane.data().len()).is_ok(), "every pixel has a 32-bit index");
    assert!(plane.width().max(plane.height()) < 1 << 23, "every place has 32 bits in Q8");
    let axes = [Axis::new(valid.x, valid.width), Axis::new(valid.y, valid.height)];
    let (eights, _) = out.as_chunks_mut::<LANES>();
    for (i, out) in eights.iter_mut().enumerate() {
        // SAFETY: this function runs on AVX2 alone, and the run is as long as `out`.
        let [x, y] = unsafe { positions.eight(i * LANES) };
        let (x, y) = (axes[0].between(x), axes[1].between(y));
        let rows = match near_rows(plane, &x, &y) {
            Some(rows) => rows,
            None => far_rows(plane, &x, &y),
        };
        let pixels = down(rows, y.way);
        // SAFETY: `out` holds 8 pixels of 32 bits, and the store needs no alignment.
        unsafe { _mm256_storeu_si256(out.as_mut_ptr().cast(), pixels) };
    }
    eights.len() * LANES
}

/// Both rows interpolated to the right, wherever the positions lie. They are clamped to a
/// rectangle that lies inside the plane, of which every pixel has a 32-bit index.
#[inline]
#[target_feature(enable = "avx2")]
fn far_rows(plane: &Plane<Rgba8>, x: &Between, y: &Between) -> [[__m256i; 2]; 2] {
    let width = _mm256_set1_epi32(plane.width().cast_signed());
    let row = |row: __m256i| {
        let start = _mm256_mullo_epi32(row, width);
        let read = |column: __m256i| {
            let index = _mm256_add_epi32(start, column);
            // SAFETY: the caller clamped to a rectangle inside the plane, so
            // row * width + column is the index of a pixel of 4 bytes.
            unsafe { _mm256_i32gather_epi32::<4>(plane.data().as_ptr().cast(), index) }
        };
        across(read(x.low), read(x.high), x.way)
    };
    [row(y.low), row(y.high)]
}

/// Both rows interpolated to the right, where all positions lie in one row and at most 7 pixels
/// right of the first: then two loads hold what a gather would fetch one by one.
///
/// The pixel after the last valid one may be read, where its weight is 0.
#[inline]
#[target_feature(enable = "avx2")]
fn near_rows(plane: &Plane<Rgba8>, x: &Between, y: &Between) -> Option<[[__m256i; 2]; 2]> {
    let first = _mm256_cvtsi256_si32(x.low);
    let column = _mm256_sub_epi32(x.low, _mm256_set1_epi32(first));
    let row = _mm256_cvtsi256_si32(y.low);
    let far = _mm256_andnot_si256(_mm256_set1_epi32(LANES as i32 - 1), column);
    let other_row = _mm256_xor_si256(y.low, _mm256_set1_epi32(row));
    let apart = _mm256_or_si256(far, other_row);
    if _mm256_testz_si256(apart, apart) == 0 {
        return None;
    }
    let nine = |row: i32| {
        let start = row as usize * plane.width() as usize + first as usize;
        plane.data().get(start..)?.first_chunk::<{ LANES + 1 }>()
    };
    let (top, bottom) = (nine(row)?, nine(_mm256_cvtsi256_si32(y.high))?);
    // Most often each pixel is read one to the right of the one before.
    let uneven = _mm256_xor_si256(column, _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
    let is_even = _mm256_testz_si256(uneven, uneven) != 0;
    let read = |nine: &[Rgba8; LANES + 1]| {
        // SAFETY: both loads are of 8 of the 9 pixels of 32 bits, and need no alignment.
        let (left, right) = unsafe {
            (
                _mm256_loadu_si256(nine.as_ptr().cast()),
                _mm256_loadu_si256(nine.as_ptr().add(1).cast()),
            )
        };
        if is_even {
            return across(left, right, x.way);
        }
        let pick = |pixels: __m256i| _mm256_permutevar8x32_epi32(pixels, column);
        across(pick(left), pick(right), x.way)
    };
    Some([read(top), read(bottom)])
}

/// The mean of pixels `i` and `i + 1` of `top` and `bottom` at `fx`, `fy` into each `out[i]`, as
/// many as whole steps hold; returns their number.
#[target_feature(enable = "avx2")]
pub(super) fn bilinear_run(
    top: &[Rgba8],
    bottom: &[Rgba8],
    fx: u32,
    fy: u32,
    out: &mut [Rgba8],
) -> usize {
    let ways = [fx, fy].map(|way| _mm256_set1_epi32(way.cast_signed()));
    let (eights, _) = out.as_chunks_mut::<LANES>();
    for (i, out) in eights.iter_mut().enumerate() {
        let row = |row: &[Rgba8]| {
            let nine = &row[i * LANES..][..=LANES];
            // SAFETY: both loads are of 8 of the 9 pixels of 32 bits, and need no alignment.
            unsafe {
                let left = _mm256_loadu_si256(nine.as_ptr().cast());
                across(left, _mm256_loadu_si256(nine.as_ptr().add(1).cast()), ways[0])
            }
        };
        let pixels = down([row(top), row(bottom)], ways[1]);
        // SAFETY: `out` holds 8 pixels of 32 bits, and the store needs no alignment.
        unsafe { _mm256_storeu_si256(out.as_mut_ptr().cast(), pixels) };
    }
    eights.len() * LANES
}

/// Pixels whose luma is made at a time.
const LUMA_LANES: usize = 32;

/// [`super::Texel::luma8`] of each of `texels`, into `out`, as many as whole steps hold; returns
/// their number.
#[target_feature(enable = "avx2")]
pub(super) fn luma8_run(texels: &[Rgba8], out: &mut [u8]) -> usize {
    // Red, green twice, blue, and no alpha: two sums of 16 bits a pixel, then one.
    let (weights, ones) = (_mm256_set1_epi32(0x0001_0201), _mm256_set1_epi16(1));
    // Packing goes on in each half of a register by itself: fours of pixels come out in this order.
    let order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
    let texels = texels.as_chunks::<LUMA_LANES>().0;
    let steps = out.as_chunks_mut::<LUMA_LANES>().0.iter_mut().zip(texels);
    let count = steps.len();
    for (out, texels) in steps {
        let four_times = |at: usize| {
            let eight = &texels[at * LANES..][..LANES];
            // SAFETY: there are 8 pixels of 32 bits, and the load needs no alignment.
            let eight = unsafe { _mm256_loadu_si256(eight.as_ptr().cast()) };
            _mm256_madd_epi16(_mm256_maddubs_epi16(eight, weights), ones)
        };
        let low = _mm256_packs_epi32(four_times(0), four_times(1));
        let high = _mm256_packs_epi32(four_times(2), four_times(3));
        let luma = _mm256_packus_epi16(_mm256_srli_epi16(low, 2), _mm256_srli_epi16(high, 2));
        let luma = _mm256_permutevar8x32_epi32(luma, order);
        // SAFETY: `out` holds 32 values of 8 bits, and the store needs no alignment.
        unsafe { _mm256_storeu_si256(out.as_mut_ptr().cast(), luma) };
    }
    count * LUMA_LANES
}

/// Interpolates to the right: 16 bits per channel, the low and the high two pixels of each half.
#[inline]
#[target_feature(enable = "avx2")]
fn across(left: __m256i, right: __m256i, way: __m256i) -> [__m256i; 2] {
    let zero = _mm256_setzero_si256();
    let twice = |weight: __m256i| _mm256_or_si256(weight, _mm256_slli_epi32(weight, 16));
    let right_weight = twice(way);
    let left_weight = twice(_mm256_sub_epi32(_mm256_set1_epi32(256), way));
    let mix = |left: __m256i, right: __m256i, left_weight: __m256i, right_weight: __m256i| {
        _mm256_add_epi16(
            _mm256_mullo_epi16(left, left_weight),
            _mm256_mullo_epi16(right, right_weight),
        )
    };
    [
        mix(
            _mm256_unpacklo_epi8(left, zero),
            _mm256_unpacklo_epi8(right, zero),
            _mm256_unpacklo_epi32(left_weight, left_weight),
            _mm256_unpacklo_epi32(right_weight, right_weight),
        ),
        mix(
            _mm256_unpackhi_epi8(left, zero),
            _mm256_unpackhi_epi8(right, zero),
            _mm256_unpackhi_epi32(left_weight, left_weight),
            _mm256_unpackhi_epi32(right_weight, right_weight),
        ),
    ]
}

/// Interpolates downwards and rounds to 8 bits per channel.
#[inline]
#[target_feature(enable = "avx2")]
fn down([top, bottom]: [[__m256i; 2]; 2], way: __m256i) -> __m256i {
    let top_weight = _mm256_sub_epi32(_mm256_set1_epi32(256), way);
    let weights = _mm256_or_si256(top_weight, _mm256_slli_epi32(way, 16));
    // The multiplication is of signed numbers: half the range is taken off and put back.
    let centred = |rows: __m256i| _mm256_xor_si256(rows, _mm256_set1_epi16(i16::MIN));
    let weigh = |rows: __m256i, weights: __m256i| {
        let sum = _mm256_madd_epi16(rows, weights);
        let back = _mm256_set1_epi32(32768 * 256 + 32768);
        _mm256_srli_epi32(_mm256_add_epi32(sum, back), 16)
    };
    let (low_top, low_bottom) = (centred(top[0]), centred(bottom[0]));
    let (high_top, high_bottom) = (centred(top[1]), centred(bottom[1]));
    let first = weigh(
        _mm256_unpacklo_epi16(low_top, low_bottom),
        _mm256_shuffle_epi32::<0b00_00_00_00>(weights),
    );
    let second = weigh(
        _mm256_unpackhi_epi16(low_top, low_bottom),
        _mm256_shuffle_epi32::<0b01_01_01_01>(weights),
    );
    let third = weigh(
        _mm256_unpacklo_epi16(high_top, high_bottom),
        _mm256_shuffle_epi32::<0b10_10_10_10>(weights),
    );
    let fourth = weigh(
        _mm256_unpackhi_epi16(high_top, high_bottom),
        _mm256_shuffle_epi32::<0b11_11_11_11>(weights),
    );
    _mm256_packus_epi16(_mm256_packs_epi32(first, second), _mm256_packs_epi32(third, fourth))
}
