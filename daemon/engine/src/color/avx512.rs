//! Reads sixteen `rgba8` pixels at a time between their neighbours.
//!
//! The same arithmetic as [`super::avx2`]. Sixteen pixels that follow each other are most often
//! read in at most three rows and thirty columns: then what a gather would fetch one by one is
//! picked out of two registers for each row. The caller asks the processor whether it has what
//! [`crate::simd`] means by AVX-512.

use std::arch::x86_64::{
    __m512i, __mmask16, _MM_HINT_T0, _mm_cvtsi128_si32, _mm_extract_epi32, _mm_prefetch,
    _mm512_add_epi16, _mm512_add_epi32, _mm512_and_si512, _mm512_castsi512_si128,
    _mm512_cmpgt_epu32_mask, _mm512_dpwssd_epi32, _mm512_extracti32x4_epi32,
    _mm512_i32gather_epi32, _mm512_loadu_si512, _mm512_mask_blend_epi32,
    _mm512_mask_reduce_min_epi32, _mm512_max_epi32, _mm512_min_epi32, _mm512_mullo_epi16,
    _mm512_mullo_epi32, _mm512_or_si512, _mm512_packs_epi32, _mm512_packus_epi16,
    _mm512_permutex2var_epi32, _mm512_set1_epi16, _mm512_set1_epi32, _mm512_setzero_si512,
    _mm512_shuffle_epi32, _mm512_slli_epi32, _mm512_srai_epi32, _mm512_srli_epi32,
    _mm512_storeu_si512, _mm512_sub_epi32, _mm512_unpackhi_epi8, _mm512_unpackhi_epi16,
    _mm512_unpackhi_epi32, _mm512_unpacklo_epi8, _mm512_unpacklo_epi16, _mm512_unpacklo_epi32,
    _mm512_xor_si512,
};

use super::Rgba8;
use crate::plane::{Plane, Rect};
use crate::warp::sample::Positions;

/// Pixels of one step.
pub(super) const LANES: usize = 16;
/// Pixels of a row that are at hand at once.
const WINDOW: usize = 2 * LANES;

/// One axis of a valid rectangle.
struct Axis {
    first: __m512i,
    last: __m512i,
}

/// One axis of sixteen positions: the pixel before, and the way to the one after.
struct Between {
    low: __m512i,
    way: __m512i,
}

impl Axis {
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn new(start: u32, length: u32) -> Self {
        Self {
            first: _mm512_set1_epi32((start << 8).cast_signed()),
            last: _mm512_set1_epi32(((start + length - 1) << 8).cast_signed()),
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn between(&self, position: __m512i) -> Between {
        let clamped = _mm512_min_epi32(_mm512_max_epi32(position, self.first), self.last);
        Between {
            low: _mm512_srai_epi32(clamped, 8),
            way: _mm512_and_si512(clamped, _mm512_set1_epi32(0xff)),
        }
    }

    /// The pixel after.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn high(&self, low: __m512i) -> __m512i {
        let next = _mm512_add_epi32(low, _mm512_set1_epi32(1));
        _mm512_min_epi32(next, _mm512_srai_epi32(self.last, 8))
    }
}

/// Both rows around sixteen positions, each at the pixel before and after.
struct Corners {
    top: [__m512i; 2],
    bottom: [__m512i; 2],
}

/// The colours of `plane` at `positions`, clamped to `valid`, into `out`, as many as whole steps
/// hold; returns their number.
///
/// # Panics
/// If `valid` does not lie inside the plane, or the plane has 2^31 pixels or more, or 2^23 along
/// an axis.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vnni")]
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
    let (sixteens, _) = out.as_chunks_mut::<LANES>();
    for (i, out) in sixteens.iter_mut().enumerate() {
        // SAFETY: this function runs on AVX-512 alone, and the run is as long as `out`.
        let [x, y] = unsafe { positions.sixteen(i * LANES) };
        let (x, y) = (axes[0].between(x), axes[1].between(y));
        let wanted = positions.wanted(i * LANES);
        if wanted == 0 {
            continue;
        }
        let corners = match near_corners(plane, x.low, y.low, wanted) {
            Some(corners) => corners,
            None => far_corners(plane, [x.low, axes[0].high(x.low)], [y.low, axes[1].high(y.low)]),
        };
        let weights = Weights::new(x.way);
        let pixels = down([weights.across(corners.top), weights.across(corners.bottom)], y.way);
        // SAFETY: `out` holds 16 pixels of 32 bits, and the store needs no alignment.
        unsafe { _mm512_storeu_si512(out.as_mut_ptr().cast(), pixels) };
    }
    sixteens.len() * LANES
}

/// The corners wherever the positions lie: columns and rows are those of a rectangle that lies
/// inside the plane, of which every pixel has a 32-bit index.
#[inline]
#[target_feature(enable = "avx512f")]
fn far_corners(plane: &Plane<Rgba8>, columns: [__m512i; 2], rows: [__m512i; 2]) -> Corners {
    let width = _mm512_set1_epi32(plane.width().cast_signed());
    let [top, bottom] = [_mm512_mullo_epi32(rows[0], width), _mm512_mullo_epi32(rows[1], width)];
    Corners {
        top: [gather(plane, top, columns[0]), gather(plane, top, columns[1])],
        bottom: [gather(plane, bottom, columns[0]), gather(plane, bottom, columns[1])],
    }
}

/// The pixels at `row` (index of its first pixel) and `column`, which the caller has clamped to a
/// rectangle inside the plane.
#[inline]
#[target_feature(enable = "avx512f")]
fn gather(plane: &Plane<Rgba8>, row: __m512i, column: __m512i) -> __m512i {
    let index = _mm512_add_epi32(row, column);
    // SAFETY: the caller clamped to the plane, so that this is the index of a pixel of 4 bytes.
    unsafe { _mm512_i32gather_epi32::<4>(index, plane.data().as_ptr().cast()) }
}

/// The corners where all positions that are wanted lie in two rows and within [`WINDOW`] columns.
///
/// The pixel or row after the last valid one may be read, where its weight is 0.
#[inline]
#[target_feature(enable = "avx512f")]
fn near_corners(
    plane: &Plane<Rgba8>,
    x: __m512i,
    y: __m512i,
    wanted: __mmask16,
) -> Option<Corners> {
    let (first, row) = if wanted == __mmask16::MAX {
        // Positions most often go one way: the smallest is at one of the ends.
        let ([head_x, tail_x], [head_y, tail_y]) = (ends(x), ends(y));
        (head_x.min(tail_x), head_y.min(tail_y))
    } else {
        (_mm512_mask_reduce_min_epi32(wanted, x), _mm512_mask_reduce_min_epi32(wanted, y))
    };
    let column = _mm512_sub_epi32(x, _mm512_set1_epi32(first));
    let below = _mm512_sub_epi32(y, _mm512_set1_epi32(row));
    let is_far = |offset: __m512i, last: usize| -> __mmask16 {
        _mm512_cmpgt_epu32_mask(offset, _mm512_set1_epi32(last as i32))
    };
    // The pixel after the last column is in the window, too.
    if (is_far(column, WINDOW - 2) | is_far(below, 1)) & wanted != 0 {
        return None;
    }
    let is_below = is_far(below, 0) & wanted;
    let (width, last_row) = (plane.width() as usize, plane.height() as usize - 1);
    let after = _mm512_add_epi32(column, _mm512_set1_epi32(1));
    let read = |row: usize| {
        let window = plane.data().get(row.min(last_row) * width + first as usize..)?;
        let window: &[Rgba8; WINDOW] = window.first_chunk()?;
        // What is read now is read once more one row below, and the row below that has to come.
        let ahead = window.as_ptr().wrapping_add(width);
        _mm_prefetch::<_MM_HINT_T0>(ahead.cast());
        // SAFETY: the window holds 2 times 16 pixels of 32 bits, and the loads need no alignment.
        let halves = unsafe {
            [
                _mm512_loadu_si512(window.as_ptr().cast()),
                _mm512_loadu_si512(window.as_ptr().add(LANES).cast()),
            ]
        };
        let pick = |column| _mm512_permutex2var_epi32(halves[0], column, halves[1]);
        Some([pick(column), pick(after)])
    };
    let row = row as usize;
    let (top, bottom) = (read(row)?, read(row + 1)?);
    if is_below == 0 {
        return Some(Corners { top, bottom });
    }
    let lowest = read(row + 2)?;
    let either = |upper: [__m512i; 2], lower: [__m512i; 2]| {
        [0, 1].map(|side| _mm512_mask_blend_epi32(is_below, upper[side], lower[side]))
    };
    Some(Corners { top: either(top, bottom), bottom: either(bottom, lowest) })
}

/// The first and the last of sixteen.
#[inline]
#[target_feature(enable = "avx512f")]
fn ends(v: __m512i) -> [i32; 2] {
    [
        _mm_cvtsi128_si32(_mm512_castsi512_si128(v)),
        _mm_extract_epi32::<3>(_mm512_extracti32x4_epi32::<3>(v)),
    ]
}

/// Weights of the pixels before and after, 16 bits per channel, for the low and the high two
/// pixels of each quarter.
struct Weights {
    left: [__m512i; 2],
    right: [__m512i; 2],
}

impl Weights {
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn new(way: __m512i) -> Self {
        let per_channel = |weight: __m512i| {
            let twice = _mm512_or_si512(weight, _mm512_slli_epi32(weight, 16));
            [_mm512_unpacklo_epi32(twice, twice), _mm512_unpackhi_epi32(twice, twice)]
        };
        let left = _mm512_sub_epi32(_mm512_set1_epi32(256), way);
        Self { left: per_channel(left), right: per_channel(way) }
    }

    /// Interpolates to the right.
    #[inline]
    #[target_feature(enable = "avx512f,avx512bw")]
    fn across(&self, [left, right]: [__m512i; 2]) -> [__m512i; 2] {
        let zero = _mm512_setzero_si512();
        let mix = |left: __m512i, right: __m512i, half: usize| {
            _mm512_add_epi16(
                _mm512_mullo_epi16(left, self.left[half]),
                _mm512_mullo_epi16(right, self.right[half]),
            )
        };
        [
            mix(_mm512_unpacklo_epi8(left, zero), _mm512_unpacklo_epi8(right, zero), 0),
            mix(_mm512_unpackhi_epi8(left, zero), _mm512_unpackhi_epi8(right, zero), 1),
        ]
    }
}

/// Interpolates downwards and rounds to 8 bits per channel.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512vnni")]
fn down([top, bottom]: [[__m512i; 2]; 2], way: __m512i) -> __m512i {
    let top_weight = _mm512_sub_epi32(_mm512_set1_epi32(256), way);
    let weights = _mm512_or_si512(top_weight, _mm512_slli_epi32(way, 16));
    // The multiplication is of signed numbers: half the range is taken off and put back.
    let centred = |rows: __m512i| _mm512_xor_si512(rows, _mm512_set1_epi16(i16::MIN));
    let back = _mm512_set1_epi32(32768 * 256 + 32768);
    let weigh = |rows: __m512i, weights: __m512i| {
        _mm512_srli_epi32(_mm512_dpwssd_epi32(back, rows, weights), 16)
    };
    let (low_top, low_bottom) = (centred(top[0]), centred(bottom[0]));
    let (high_top, high_bottom) = (centred(top[1]), centred(bottom[1]));
    let first = weigh(
        _mm512_unpacklo_epi16(low_top, low_bottom),
        _mm512_shuffle_epi32::<0b00_00_00_00>(weights),
    );
    let second = weigh(
        _mm512_unpackhi_epi16(low_top, low_bottom),
        _mm512_shuffle_epi32::<0b01_01_01_01>(weights),
    );
    let third = weigh(
        _mm512_unpacklo_epi16(high_top, high_bottom),
        _mm512_shuffle_epi32::<0b10_10_10_10>(weights),
    );
    let fourth = weigh(
        _mm512_unpackhi_epi16(high_top, high_bottom),
        _mm512_shuffle_epi32::<0b11_11_11_11>(weights),
    );
    _mm512_packus_epi16(_mm512_packs_epi32(first, second), _mm512_packs_epi32(third, fourth))
}
